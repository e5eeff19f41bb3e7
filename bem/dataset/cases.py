"""Campaigns of any scenes and protocols, and their file of whole trajectories.

Where a data set holds protocols of three phases at fixed measurement steps, this file holds for every case the scene,
the protocol and what `bem.simulate` returned. docs/cluster.md describes its groups. Units as in
`bem.results.trajectory`.

Scenes, protocols and trajectories are JSON there: `{"type": "Scene", "tabor": 1.0, "material": {"type": "Elastic"},
...}`. Objects are described by the name of their public class and its fields. Numbers are written with all their
digits. JSON has no NaN: such numbers are left out.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, fields, is_dataclass
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from bem._support.wording import shown
from bem.dataset.campaign import Job, Solver, solver_name
from bem.dataset.file import check_attributes, check_columns, read_file
from bem.dataset.records import RESULTS, Columns, Record, layout_of, untabulate
from bem.problem import indenter, materials, tractions
from bem.problem import protocol as protocols
from bem.problem import scene as scenes
from bem.problem.accuracy import resolve_accuracy
from bem.problem.protocol import ForceProtocol, LoadingProtocol, PiecewiseLinearProtocol, Protocol, history_of
from bem.problem.scene import Scene
from bem.results.trajectory import Jump, Statistics, Trajectory

FORMAT, LABEL = "viscoelastic-contact-cases", "file of cases"
ARRAYS = {"time": float, "indentation": float, "force": float, "contact_radius": float, "unloading": np.uint8}
"""The arrays of a trajectory, and their types in a file."""
_VOCABULARY = (indenter, materials, protocols, scenes, tractions)
_LATER = ("spring", "indenter")  # fields of a scene that are left out where there is none, as in files of before
LAYOUT = layout_of(
    {"outcome": object}
    | {f"scalars/{name}": np.float64 for name in RESULTS}
    | {f"native/{name}": dtype for name, dtype in ARRAYS.items()}
)


class Case(NamedTuple):
    """A case of a campaign with its result.

    Args:
        scene, protocol: what was simulated.
        trajectory: what `bem.simulate` returned; `None` where it raised an error.
        reason: why there is no completed trajectory, empty where there is one.
    """

    scene: Scene
    protocol: Protocol
    trajectory: Trajectory | None
    reason: str


class Cases(Job):
    """Scenes and protocols to simulate: any material, any adhesion, any indentation history.

    Args:
        cases: pairs of a `Scene` and a protocol of any kind, at least one.
        accuracy: as in `bem.simulate`, the same for all.

    Raises:
        ValueError: naming the quantity, what is allowed and what was received.

    Examples:
        >>> from bem import Cases, Elastic, LoadingProtocol, Scene
        >>> protocol = LoadingProtocol(peak_indentation=2.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0)
        >>> len(Cases([(Scene(tabor=mu, material=Elastic()), protocol) for mu in (0.5, 1.0)]))
        2
    """

    finite_in = "native/"  # a trajectory that never unloads has no pull-off force
    layout, form = LAYOUT, FORMAT
    without_trajectory = {"outcome": "null"}  # noqa: RUF012

    def __init__(self, cases: Iterable[tuple[Scene, Protocol]], accuracy: str | float = "standard") -> None:
        resolve_accuracy(accuracy)
        self.accuracy = accuracy
        self.cases = [_checked(number, case) for number, case in enumerate(cases)]
        if not self.cases:
            raise ValueError("cases must hold at least one pair of a scene and a protocol; received none")
        self.indices = np.arange(len(self.cases))
        self._texts = [
            (json.dumps(described(scene)), json.dumps(described(protocol))) for scene, protocol in self.cases
        ]

    def __len__(self) -> int:
        return len(self.cases)

    def __getstate__(self) -> dict[str, Any]:
        return {"accuracy": self.accuracy}

    def identity(self, solver: Solver | None = None) -> dict[str, Any]:
        """Everything that determines the numbers."""
        digest = hashlib.sha256(json.dumps(self._texts).encode()).hexdigest()
        return {"cases": digest, "count": len(self), "accuracy": self.accuracy, "solver": solver_name(solver)}

    def cases_of(self, indices: np.ndarray) -> list[tuple[Scene, Protocol]]:
        """Some of the cases."""
        return [self.cases[index] for index in indices]

    def inputs(self, indices: np.ndarray) -> Columns:
        """Scenes and protocols as JSON."""
        texts = np.array(self._texts, dtype=object)[indices]
        return {"scene": texts[:, 0], "protocol": texts[:, 1]}

    def kept(self, trajectory: Any, _: tuple[Scene, Protocol]) -> tuple[Record, Record]:
        """The whole trajectory, also one that ends early; the results of a completed one."""
        record = {f"native/{name}": getattr(trajectory, name) for name in ARRAYS} | {
            "outcome": outcome_text(trajectory)
        }
        return record, {f"scalars/{name}": float(getattr(trajectory, name)) for name in RESULTS}

    def read(self, path: Path) -> tuple[Columns, dict[str, Any]]:
        """Arrays and root attributes of a complete file; see `load_cases` for its errors."""
        return read_file(path, _cases, form=FORMAT, label=LABEL)[:2]


def load_cases(path: str | Path) -> list[Case]:
    """Read the file that `bem.run_campaign` wrote of `bem.Cases`.

    Returns:
        the cases in their order, each with its scene, its protocol and the trajectory that `bem.simulate` returned.

    Raises:
        FileNotFoundError: no such file.
        DamagedFileError: a `ValueError`; the file is damaged, or its parts are inconsistent.
        ValueError: not such a file, or of another version of the format.
    """
    return read_file(Path(path), _cases, form=FORMAT, label=LABEL)[2]


def _cases(columns: Columns, attributes: dict[str, Any], _: h5py.File) -> tuple[Columns, dict[str, Any], list[Case]]:
    check_attributes(attributes, ("cases", "count", "accuracy", "solver"))
    layout = {**LAYOUT, "scene": np.dtype(object), "protocol": np.dtype(object)}
    check_columns(columns, layout, attributes["campaign"]["count"])
    cases = [
        Case(restored(json.loads(scene)), restored(json.loads(protocol)), restored_trajectory(record), record["reason"])
        for scene, protocol, record in zip(
            columns["scene"], columns["protocol"], untabulate(columns, LAYOUT), strict=True
        )
    ]
    return columns, attributes, cases


def _checked(number: int, case: Any) -> tuple[Scene, Protocol]:
    match case:
        case (Scene() as scene, LoadingProtocol() | PiecewiseLinearProtocol() | ForceProtocol() as protocol):
            try:
                history_of(protocol, scene.tabor)
            except ValueError as error:
                raise ValueError(f"case {number}: {error}") from error
            return scene, protocol
    raise ValueError(f"case {number} must be a Scene and a protocol; received {shown(case)}")


def described(value: Any) -> Any:
    """Describe an object of one of the public classes by what JSON can hold.

    Raises:
        ValueError: an object of another class, which could not be read again.
    """
    if is_dataclass(value):
        name = type(value).__name__
        _public(name, type(value))
        values = {field.name: getattr(value, field.name) for field in fields(value)}
        values = {name: kept for name, kept in values.items() if kept is not None or name not in _LATER}
        return {"type": name} | {field: described(kept) for field, kept in values.items()}
    if isinstance(value, np.ndarray):
        return value.tolist()
    return list(value) if isinstance(value, tuple) else value


def restored(description: Any) -> Any:
    """Return the object of a description by `described`.

    Raises:
        ValueError: this is no such description.
    """
    if not isinstance(description, dict):
        return tuple(description) if isinstance(description, list) else description
    cls = _public(description.get("type"))
    names = [field.name for field in fields(cls) if field.name not in _LATER or field.name in description]
    values = {name: restored(description[name]) for name in names}
    # Classes with a constructor of their own take their fields in order, perhaps under other names.
    return cls(**values) if vars(cls)["__dataclass_params__"].init else cls(*values.values())


def outcome_text(trajectory: Trajectory) -> str:
    """What a trajectory holds besides its arrays, as JSON."""
    outcome = {name: getattr(trajectory, name) for name in ("status", "accuracy", "energy_balance")}
    outcome["jumps"] = [_numbers(asdict(jump)) for jump in trajectory.jumps]
    outcome["stats"] = asdict(trajectory.stats)
    # As files of before, which held no others.
    usual = {"spring": None, "by_force": False, "attraction": 1.0}
    outcome |= {name: value for name, default in usual.items() if (value := getattr(trajectory, name)) != default}
    return json.dumps(_numbers(outcome), allow_nan=False, default=lambda number: number.item())


def restored_trajectory(record: Mapping[str, Any]) -> Trajectory | None:
    """Return the trajectory of a record, of its outcome and the arrays in `native/`; `None` where there is none."""
    outcome = json.loads(record["outcome"])
    if outcome is None:
        return None
    arrays: dict[str, Any] = {name: record[f"native/{name}"] for name in ARRAYS}
    arrays["unloading"] = arrays["unloading"].astype(bool)
    outcome["jumps"] = tuple(Jump(**with_nan(Jump, jump)) for jump in outcome["jumps"])
    stats = outcome["stats"]
    if "rung" in stats:  # as files of before called it
        stats["method"] = stats.pop("rung")
    outcome["stats"] = Statistics(**with_nan(Statistics, stats))
    return Trajectory(**arrays, **outcome)


def with_nan(cls: type, stored: dict[str, Any]) -> dict[str, Any]:
    """The fields of a dataclass of which only some were found.

    A real number that is absent is NaN; anything else was not known yet when the file was written.
    """
    types = {field.name: field.type for field in fields(cls)}
    absent = {name: np.nan for name, type_ in types.items() if type_ == "float" and name not in stored}
    return absent | {name: value for name, value in stored.items() if name in types}


def _numbers(values: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in values.items() if not (isinstance(value, float) and np.isnan(value))}


def _public(name: Any, expected: type | None = None) -> type:
    for module in _VOCABULARY:
        cls = vars(module).get(name) if isinstance(name, str) else None
        if isinstance(cls, type) and is_dataclass(cls) and expected in (None, cls):
            return cls
    raise ValueError(f"scenes and protocols must be made of the public classes of bem; received {shown(name)}")
