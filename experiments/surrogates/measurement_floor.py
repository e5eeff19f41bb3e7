"""How well measurement steps hold what they measure: uniform ones as in the paper, and physical ones.

The solver's own forces at the steps are a perfect model's. Their largest, and the top of the parabola through it and
its neighbours, are compared with the solver's pull-off force, their loop area with its hysteresis: by the trapezoidal
rule, as the paper does, and by monotone cubics.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem import Trajectory
from bem._support.command_line import run_main
from bem._support.plain_json import plain
from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import FMS, PHYSICAL, measurement_grid
from bem.dataset.physical_steps import physical_grid
from experiments.common import write_result
from experiments.surrogates.hidden_protocols import ANY_SOLID, Hidden, quantiles
from experiments.timing import MEASUREMENTS

OUT = MEASUREMENTS / "measurement_floor.json"
EXAMPLE = {
    "tabor": 0.55,
    "peak_indentation": 69.0,
    "loading_rate": 1.2,
    "dwell_time": 0.003,
    "unloading_rate": 900.0,
    "modulus_ratio": 0.04,
}
"""A narrow peak, drawn with both kinds of steps."""
KINDS = {"uniform": FMS, "physical": PHYSICAL}


def grid(kind: str, protocols: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Instants and indentations of the steps of some protocols, each (n, N)."""
    if kind == "physical":
        return physical_grid(**protocols)
    return measurement_grid(**{name: protocols[name] for name in QUANTITIES}, counts=FMS)


def errors(
    true: Trajectory, times: np.ndarray, indentations: np.ndarray, counts: tuple[int, int, int]
) -> tuple[float, float, float, float]:
    """Relative errors of the highest step, of a parabola's top there, and of the loop by trapezoids and by cubics."""
    from surrogate.pretrained.kernels import results

    force = true.at(np.minimum(times, true.time[-1]))
    top, _, _, area = results(times[np.newaxis], indentations[np.newaxis], force[np.newaxis], np.array(counts))[:, 0]
    trapezoids = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(indentations))
    loop = true.hysteresis
    highest = force[counts[0] + counts[1] - 1 :].max()
    return (
        abs(highest / true.pull_off_force - 1.0),
        abs(top / true.pull_off_force - 1.0),
        abs(abs(trapezoids) - loop) / loop,
        abs(abs(area) - loop) / loop,
    )


def example() -> dict[str, Any]:
    """The force of one protocol, and both kinds of steps on it, while unloading."""
    protocol = {name: np.array([value]) for name, value in EXAMPLE.items()}
    (true,) = Hidden(protocol).simulated()
    found = {"indentation": true.indentation[true.unloading], "force": true.force[true.unloading], "steps": {}}
    for kind, counts in KINDS.items():
        times, indentations = (values[0, counts[0] + counts[1] - 1 :] for values in grid(kind, protocol))
        force = true.at(np.minimum(times, true.time[-1]))
        found["steps"][kind] = {"indentation": indentations, "force": force}
    return found


def main(
    count: Annotated[int, typer.Option(help="How many protocols.")] = 2000,
    out: Annotated[Path, typer.Option(help="Result file to write.")] = OUT,
) -> None:
    """Measure the floor of both kinds of steps on hidden protocols of any modulus ratio."""
    hidden = Hidden.draw(count, ANY_SOLID)
    grids = {kind: grid(kind, hidden.quantities) for kind in KINDS}
    found: dict[str, list[tuple[float, ...]]] = {kind: [] for kind in KINDS}
    for row, true in enumerate(hidden.simulated()):
        for kind, (times, indentations) in grids.items():
            found[kind].append(errors(true, times[row], indentations[row], KINDS[kind]))
    content: dict[str, Any] = {"count": count, "example": example(), "kinds": {}}
    for kind, counts in KINDS.items():
        pull_off, parabola, trapezoids, cubics = np.array(found[kind]).T
        content["kinds"][kind] = {
            "counts": counts,
            "pull_off": quantiles(pull_off),
            "pull_off_parabola": quantiles(parabola),
            "hysteresis_trapezoids": quantiles(trapezoids),
            "hysteresis_cubics": quantiles(cubics),
            "pull_off_errors": np.sort(pull_off),
        }
        print(kind, counts, {name: values for name, values in content["kinds"][kind].items() if "errors" not in name})
    write_result(out, f"measurement_floor --count {count}", plain(content))


if __name__ == "__main__":
    run_main(main)
