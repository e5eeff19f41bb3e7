"""Places where the paper's text contradicts its own numbers, its equations or the physics, each with a computation.

`python -m experiments inconsistencies --only NAME` prints the computation of one of them. The paper's statements are in
`paper_values/slips.toml`.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from scipy.special import ellipk

from experiments import common
from experiments.common import Dataset
from experiments.paper_numbers import paper_claims, paper_rows, stated
from experiments.published_models import paper_mse


def start_force() -> dict[str, float]:
    """Force of the relaxed sphere at the start indentation, for the smallest and the largest Tabor parameter."""
    from experiments.cases import Case

    ramps = {"peak_indentation": 2.0, "loading_rate": 1.0, "dwell_time": 1.0, "unloading_rate": 1.0}
    trajectories = {mu: Case.of({"tabor": mu, **ramps}).simulated("reference") for mu in (0.2, 3.2)}
    return {f"force at the start, mu = {mu}": float(trajectory.force[0]) for mu, trajectory in trajectories.items()}


def end_force(dataset: Path = common.DATASET) -> dict[str, float]:
    """Share of the trajectories of the data set whose end force exceeds half of their pull-off force."""
    from bem.dataset.file import load_dataset

    data = load_dataset(dataset)
    end, pull_off = (data.scalars[name][data.completed] for name in ("end_force", "pull_off_force"))
    return {"end force above half the pull-off force, share of trajectories": float(np.mean(end > 0.5 * pull_off))}


def longest_pull_off_time() -> dict[str, float]:
    """Duration of the slowest loading to the deepest peak in the paper's ranges; pull-off comes later."""
    from bem.dataset.designs import PAPER_RANGES
    from bem.problem.protocol import default_start_indentation

    tabor, peak, rate = PAPER_RANGES["tabor"][1], PAPER_RANGES["peak_indentation"][1], PAPER_RANGES["loading_rate"][0]
    return {"duration of the slowest loading": float((peak - default_start_indentation(tabor)) / rate)}


def influence_scaling() -> dict[str, float]:
    """Depth of a Hertz contact from its pressure, by u = mu G sigma and by the appendix, which divides G by mu."""
    from bem.methods.boundary_elements.influence.triangles import influence_matrix

    tabor, radius = 3.0, 2.0
    radii = np.linspace(0.0, radius, 400)
    # Hertz: p = p0 sqrt(1 - r^2 / a^2) presses the centre in by a^2 / R; here delta = mu a^2 and p0 = 2 a / pi.
    pressure = 2.0 * radius / np.pi * np.sqrt(1.0 - (radii / radius) ** 2)
    ours = tabor * float(influence_matrix(radii)[0] @ pressure)
    return {"exact": tabor * radius**2, "u = mu G sigma": ours, "appendix, G divided by mu": ours / tabor}


def history_sum() -> dict[str, float]:
    """Errors of three creep sums for the traction sin(t), 0 <= t <= 3, with steps of 0.1 and 0.05.

    The sums are that of the appendix, without its last term, which needs the traction after the end; the same sum with
    the index of the traction reduced by one, which `bem.methods.paper_method` computes; and the sum for a traction that
    is linear in each step.
    """
    ratio, end = 0.1, 3.0
    exact = np.sin(end) - (1.0 - ratio) * 0.5 * (np.cos(end) + np.sin(end) - np.exp(-end))
    errors = {}
    for step in (0.1, 0.05):
        times = np.linspace(0.0, end, round(end / step) + 1)
        rise = np.diff(np.sin(times))
        creep = 1.0 + (ratio - 1.0) * np.exp(-(end - times))
        decay = np.exp(-step)
        mean = 1.0 + (ratio - 1.0) * (1.0 - decay) / step * np.exp(-(end - times[1:]))
        errors[f"appendix's sum, step {step}"] = float(abs(np.sum(creep[:-1] * rise) / exact - 1.0))
        errors[f"increments at the ends of steps, step {step}"] = float(abs(np.sum(creep[1:] * rise) / exact - 1.0))
        errors[f"linear traction in each step, step {step}"] = float(abs(np.sum(mean * rise) / exact - 1.0))
    return errors


def concatenation_point() -> dict[str, float]:
    """Parameters of M4-concat if the Tabor parameter enters before the first block, and after the last."""
    kernel, widths = 3, (64, 64, 128, 128)

    def blocks(channels: int) -> int:
        total = 0
        for width in widths:
            stages = (kernel * channels * width + width) + (kernel * width * width + width) + 4 * width
            total += stages + (channels * width + width if channels != width else 0)
            channels = width
        return total

    before, after = (blocks(channels) + 64 * (width + 1) + 65 for channels, width in ((5, 128), (4, 129)))
    return {"before the first block": before, "after the last block": after}


CLAIMS = paper_claims()
BEST = [claim["value"] for claim in CLAIMS if claim["says"].startswith("best conditioning of ")]
SECONDS = [row["surrogate_seconds"] for row in paper_rows("canonical_protocols")]
GAP = 3.0 ** (1.0 / 6.0)
LARGEST = 8.0 / 3.0 * (GAP**-3 - GAP**-9)
"""Gap of the largest tension, and the tension there by the law of the main text; the appendix has the other sign."""
SLIPS: dict[str, Callable[[], dict[str, float]]] = {
    "start-force": start_force,
    "end-force": end_force,
    "longest-pull-off-time": longest_pull_off_time,
    "influence-scaling": influence_scaling,
    "history-sum": history_sum,
    "traction-sign": lambda: {"main text": LARGEST, "appendix": -LARGEST},
    "concatenation-point": concatenation_point,
    # The highlights state 0.25 s.
    "inference-time": lambda: {
        "median of the table (s)": float(np.median(SECONDS)),
        "mean of the table (s)": float(np.mean(SECONDS)),
    },
    # Of the last share of training data but one; the paper states 1.55125 %.
    "halving": lambda: {"half of 3.125 (%)": 3.125 / 2.0},
    # The paper states 5.0e-4.
    "quartile-mean": lambda: {
        "mean of the quartile means": float(np.mean([row["mse_mean"] for row in paper_rows("quartiles")]))
    },
    # The paper itself finds concatenation best in so many families.
    "concatenation-superiority": lambda: {
        "families": len(BEST),
        "of these with concatenation best": BEST.count("concat"),
    },
    "mean-time": lambda: {
        "mean (s)": 3600.0 * stated("dataset:cpu_hours") / stated("dataset:trajectories"),
        "fastest of the table (s)": min(row["bem_seconds"] for row in paper_rows("canonical_protocols")),
    },
    "modulus": lambda: {"1 / (1 - nu^2) of an incompressible solid": 1.0 / (1.0 - 0.5**2)},
    "two-betas": lambda: {"as a number": 9.0 * np.sqrt(3.0) / 16.0},
    "influence-diagonal": lambda: {
        f"G r at distance {distance:g} from a node": 4.0 / np.pi * float(ellipk((1.0 - distance) ** 2))
        for distance in (1e-2, 1e-4, 1e-6)
    },
    "four-groups": lambda: {"remainder of 1,245 by four": 1245 % 4},
    # The MSE that the highlights state in per cent, as a plain number.
    "percent-mse": lambda: {
        "highlights, as a bare number": stated("reference_model:highlights_mse_percent") / 100.0,
        "abstract": paper_mse(),
    },
}


def study(
    dataset: Dataset = common.DATASET,
    *,
    only: Annotated[list[str] | None, typer.Option(help="Print this one and write nothing; repeatable.")] = None,
) -> dict[str, Any] | None:
    """Compute the inconsistencies. With `only`, print the named ones and return `None`.

    Raises:
        ValueError: There is no inconsistency of that name.
    """
    if unknown := sorted(set(only or ()) - set(SLIPS)):
        raise ValueError(f"--only must be one of {', '.join(SLIPS)}; received {unknown[0]!r}")
    slips = {name: end_force(dataset) if name == "end-force" else SLIPS[name]() for name in only or SLIPS}
    for name, values in slips.items():
        print(name, *(f"  {quantity}: {value:.6g}" for quantity, value in values.items()), sep="\n")
    return None if only else {"slips": slips}
