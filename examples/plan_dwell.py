"""Plan an experiment: what dwell makes the measured adhesion insensitive to the speed of approach.

A soft viscoelastic solid remembers how it was loaded. A fast approach leaves the contact smaller than it will become,
and a retraction that follows at once measures less adhesion than one that waits. During the dwell the memory fades.
The answer is the shortest dwell after which approaches at very different speeds give one pull-off force. No dwell
removes the influence of the speed of retraction: the edge of the contact dissipates while it moves.

Run: `python examples/plan_dwell.py [PICTURE]`. It draws the pull-off force over the dwell into `plan_dwell.png`, or the
file named.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from bem import StandardLinearSolid
from bem.lab import Setup
from bem.lab.units import readable
from bem.plots import COLOURS

BEAD = Setup(
    radius=50e-6,
    work_of_adhesion=0.05,
    relaxed_modulus=2e6,
    retardation_time=0.1,
    material=StandardLinearSolid(modulus_ratio=0.1),
)
APPROACHES = (2e-7, 2e-6, 2e-5, 2e-4)  # m/s
COLORS = [COLOURS[name] for name in ("M1", "M5", "M3", "M2")]  # which readers of all eyes tell apart
RETRACTION = 2e-5  # m/s
DEPTH, START = 0.5e-6, -1.5e-6  # m
DWELLS = (0.0, *np.geomspace(1e-3, 3.0, 11))  # s
TOLERANCE = 0.02


def pull_off_force(approach: float, dwell: float, accuracy: str | float = "draft") -> float:
    """Pull-off force in N after an approach at a speed in m/s and a dwell in s."""
    protocol = BEAD.protocol(
        peak_indentation=DEPTH,
        loading_rate=approach,
        dwell_time=dwell,
        unloading_rate=RETRACTION,
        start_indentation=START,
    )
    return BEAD.simulate(protocol, accuracy, check_range=False).pull_off_force


def spread(forces: np.ndarray) -> np.ndarray:
    """Range of the pull-off forces (dwells, approaches) over their mean, for each dwell, shape (dwells,)."""
    return np.ptp(forces, axis=1) / np.mean(forces, axis=1)


def shortest(forces: np.ndarray) -> float | None:
    """Dwell, in s, from which on the spread stays below the tolerance; `None` where none of the dwells is enough."""
    sensitive = np.flatnonzero(spread(forces) > TOLERANCE)
    first = sensitive[-1] + 1 if sensitive.size else 0
    return float(DWELLS[first]) if first < len(DWELLS) else None


def in_print(speed: float) -> str:
    """A speed in m/s with its unit, in the spelling of the axes."""
    return readable(speed, "m/s").replace(" u", " µ")


def draw(forces: np.ndarray, dwell: float | None, path: str | Path) -> None:
    """Pull-off force over dwell, for each approach."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import EngFormatter

    figure = Figure(figsize=(5.5, 3.8), layout="constrained")
    axes = figure.subplots()
    for approach, column, color in zip(APPROACHES, forces.T, COLORS, strict=True):
        axes.plot(DWELLS, column, ".-", color=color, linewidth=1.2, clip_on=False, zorder=3, label=in_print(approach))
    if dwell is not None:
        axes.axvline(dwell, color="0.6", linewidth=0.8)
        words = f"within {100 * TOLERANCE:.0f} %"
        place = {"xytext": (-3, 0), "textcoords": "offset points", "xycoords": ("data", "axes fraction")}
        axes.annotate(words, (dwell, 0.02), ha="right", va="bottom", color="0.4", **place)
    axes.set_xscale("symlog", linthresh=1e-3)
    axes.set_xlim(left=0.0)
    axes.xaxis.set_major_formatter(EngFormatter("s"))
    axes.yaxis.set_major_formatter(EngFormatter("N"))
    axes.set(xlabel="dwell", ylabel=f"pull-off force, retracted at {in_print(RETRACTION)}")
    axes.legend(title="approach", loc="lower right", bbox_to_anchor=(0.9, 0.1), frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=150)


def main(path: str | Path = "plan_dwell.png") -> None:
    """Print pull-off forces and their spread over the dwell, answer the question, and draw it."""
    forces = np.array([[pull_off_force(approach, dwell) for approach in APPROACHES] for dwell in DWELLS])
    print("dwell      pull-off after an approach at", *(f"{readable(approach, 'm/s'):>9}" for approach in APPROACHES))
    for dwell, row, share in zip(DWELLS, forces, spread(forces), strict=True):
        cells = "".join(f"{readable(force, 'N'):>10}" for force in row)
        print(f"{readable(dwell, 's'):9}{cells}   spread {100 * share:.1f} %")
    dwell = shortest(forces)
    answer = "no dwell tried is enough" if dwell is None else f"wait {readable(dwell, 's')} or longer"
    print(f"for adhesion that the approach changes by less than {100 * TOLERANCE:.0f} %: {answer}")
    draw(forces, dwell, path)


if __name__ == "__main__":
    main(*sys.argv[1:2])
