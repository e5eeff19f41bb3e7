"""Cases of the measurements: one scene and protocol each, and the sets of them that questions are asked of.

A set is given as columns: the protocol's `QUANTITIES`, `modulus_ratio`, and, where it is not always there, `adhesion`
(0 or 1), each of shape (n,).
"""

from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Self

import numpy as np

from bem import (
    ConstantStress,
    Elastic,
    Exponential,
    HardContact,
    LennardJones,
    LoadingProtocol,
    PronySeries,
    Scene,
    StandardLinearSolid,
    Trajectory,
    simulate,
)
from bem.dataset.designs import PAPER_RANGES, QUANTITIES, Design
from bem.dataset.measurement_steps import FMS, measurement_grid
from bem.problem.materials import Material
from bem.problem.tractions import TractionLaw
from experiments.common import MODULUS_RATIO

HIDDEN_SEED = 901
"""Seed of the hidden protocols; the trainings use others."""
ANY_SOLID = (0.01, 1.0)
"""Modulus ratios of the solids that the pretrained models know."""
RANGES = PAPER_RANGES | {"modulus_ratio": ANY_SOLID}
BEYOND = dict(zip(QUANTITIES, ((0.02, 6.4), (0.2, 1e3), (1e-3, 1e5), (1e-6, 1e3), (1e-3, 1e5)), strict=True))
DEEPEST = 200.0  # largest peak indentation times tabor^1.5, beyond the box: the nodes of the master grid are limited
STIFF = dict(zip(QUANTITIES, ((0.01, 0.5), (0.05, 30.0), (1e-3, 1e4), (1e-4, 1e5), (1e-3, 1e4)), strict=True))
LAWS = (LennardJones(), LennardJones(), ConstantStress(), Exponential())
"""Laws of random contacts; half of them have that of the paper."""
EDGES = {
    "tabor": ("Tabor parameter", (0.2, 1.0, 2.0, 3.2)),
    "unloading_rate": ("Unloading rate", (0.1, 10.0, 100.0, 1000.0)),
    "peak_indentation": ("Peak indentation", (2.0, 20.0, 50.0, 100.0)),
    "modulus_ratio": ("Modulus ratio", (0.01, 0.1, 1.0)),
}
"""Quantities that divide protocols into regions: their names, and the bounds of the regions."""


def completed(trajectory: Trajectory, label: str) -> Trajectory:
    """The trajectory of a simulation, which must have reached its end.

    Raises:
        RuntimeError: It did not; `label` names it.
    """
    if not trajectory.completed:
        raise RuntimeError(f"{label} did not complete: {trajectory.status}")
    return trajectory


@dataclass(frozen=True)
class Case:
    """One scene and protocol."""

    scene: Scene
    protocol: LoadingProtocol

    @classmethod
    def of(cls, row: dict[str, float], modulus_ratio: float = MODULUS_RATIO) -> Self:
        """The case of one row of columns, which may have a modulus ratio of its own; 1 is an elastic solid."""
        ratio = row.get("modulus_ratio", modulus_ratio)
        material = StandardLinearSolid(ratio) if ratio < 1.0 else Elastic()
        law = LennardJones() if row.get("adhesion", 1.0) else HardContact()
        return cls(Scene(row["tabor"], material, law), LoadingProtocol(**{name: row[name] for name in QUANTITIES[1:]}))

    def run(self, accuracy: str | float) -> Trajectory:
        """Simulate the case."""
        return simulate(self.scene, self.protocol, accuracy)

    def simulated(self, accuracy: str | float, profiles: int | None = None) -> Trajectory:
        """Simulate the case to its end.

        Raises:
            RuntimeError: The simulation did not complete.
        """
        return completed(simulate(self.scene, self.protocol, accuracy, profiles=profiles), str(self))

    def grid(self, counts: tuple[int, int, int] = FMS) -> tuple[np.ndarray, np.ndarray]:
        """Instants and indentations of the measurement steps, each of shape (steps,)."""
        times, indentations = measurement_grid(tabor=self.scene.tabor, **asdict(self.protocol), counts=counts)
        return times[0], indentations[0]

    def on_steps(self, trajectory: Trajectory, counts: tuple[int, int, int] = FMS) -> dict[str, np.ndarray]:
        """Time, indentation and simulated force at the measurement steps, each of shape (steps,)."""
        times, indentations = self.grid(counts)
        return {"time": times, "indentation": indentations, "force": trajectory.at(times)}


def native(trajectory: Trajectory) -> dict[str, np.ndarray]:
    """The solver's own history, ready for JSON."""
    return {name: getattr(trajectory, name) for name in ("time", "indentation", "force")}


def held_out(count: int, dataset: Path) -> list[Case]:
    """The first protocols of the data set's test part."""
    from surrogate.data.dataset import TrajectoryDataset

    data = TrajectoryDataset.load(dataset)
    return cases_of(data.protocols_of(data.split(0).test[:count]))


def rows_of(columns: dict[str, np.ndarray]) -> list[dict[str, float]]:
    """The protocols of columns as one dictionary each."""
    return [dict(zip(columns, row, strict=True)) for row in np.column_stack(list(columns.values())).tolist()]


def cases_of(columns: dict[str, np.ndarray], modulus_ratio: float = MODULUS_RATIO) -> list[Case]:
    """The cases of columns, of this modulus ratio where there is no column of them."""
    return [Case.of(row, modulus_ratio) for row in rows_of(columns)]


def drawn(where: str, count: int, seed: int, design: str = "log-uniform") -> dict[str, np.ndarray]:
    """Columns of random protocols: 'inside' the paper's box, 'beyond' it, 'elastic' (beyond), or 'stiff'.

    Stiff contacts are nearly rigid or have a stiff glassy modulus; about half of them are without adhesion.
    """
    ranges = {"beyond": BEYOND, "elastic": BEYOND, "stiff": STIFF}.get(where, {})
    columns = Design(design, ranges).protocols(count, seed)
    columns["modulus_ratio"] = np.full(count, MODULUS_RATIO)
    if where in ("beyond", "elastic"):
        columns["modulus_ratio"] = 10.0 ** np.random.default_rng([seed, 1]).uniform(-3.0, 0.0, count)
        columns["peak_indentation"] = np.minimum(columns["peak_indentation"], DEEPEST * columns["tabor"] ** -1.5)
    if where == "elastic":
        columns["modulus_ratio"] = np.ones(count)
    if where == "stiff":
        rng = np.random.default_rng([seed, 2])
        columns["modulus_ratio"] = 10.0 ** rng.uniform(-3.0, np.log10(0.3), count)
        columns["adhesion"] = rng.integers(0, 2, count).astype(float)
    return columns


def between(random: np.random.Generator, low: float, high: float) -> float:
    """A number drawn log-uniformly."""
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def random_contact(
    random: np.random.Generator, number: int, tabors: tuple[float, float], ratios: tuple[float, float]
) -> tuple[float, Material, LennardJones | TractionLaw]:
    """Tabor parameter, solid and law; odd numbers have a Prony series, even ones a standard linear solid."""
    tabor, ratio = between(random, *tabors), between(random, *ratios)
    material: Material = StandardLinearSolid(ratio)
    if number % 2:
        terms = int(random.integers(2, 5))
        strengths = (1.0 - ratio) * random.dirichlet(np.ones(terms))
        material = PronySeries(strengths, 10.0 ** random.uniform(-1.5, 1.5, terms))
    return tabor, material, LAWS[int(random.integers(len(LAWS)))]


def hidden_protocols(
    count: int, modulus_ratio: float | tuple[float, float], seed: int = HIDDEN_SEED
) -> dict[str, np.ndarray]:
    """Columns of protocols off the paper's grid, in its ranges, which no training has seen."""
    columns = Design("log-uniform", modulus_ratio=modulus_ratio).protocols(count, seed)
    return columns if "modulus_ratio" in columns else columns | {"modulus_ratio": np.full(count, modulus_ratio)}


def regions(quantities: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Divide protocols by each quantity in turn.

    Args:
        quantities: Columns of shape (n,). One that is missing, or the same for all, divides nothing.

    Returns:
        Which protocols belong to each region, of shape (n,), by its name, such as "Tabor parameter 0.2 to 1"; first
        "all". Regions without any are left out.
    """
    masks = {"all": np.ones(len(next(iter(quantities.values()))), dtype=bool)}
    for name, (title, edges) in EDGES.items():
        values = quantities.get(name)
        if values is None or np.ptp(values) == 0.0:
            continue
        # Corners of the paper's design lie a little outside its stated range.
        interval = np.digitize(values, edges[1:-1])
        masks |= {f"{title} {low:g} to {high:g}": interval == i for i, (low, high) in enumerate(pairwise(edges))}
    return {region: rows for region, rows in masks.items() if rows.any()}
