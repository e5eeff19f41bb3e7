"""Plan an experiment in newtons and seconds: how fast to retract to hold 5 mN, and to let go below 1 mN.

A glass lens is pressed into a soft viscoelastic solid and withdrawn. Pulled fast it holds more than it would at rest,
as the edge of the contact dissipates; pulled slowly it lets go. The answer is two speeds: the slowest retraction that
holds, and the fastest that still lets go. Both belong to the effective range of adhesion, which `docs/units.md`
explains: a range half as long dissipates as much at about a third of the speed.

Run: `python examples/plan_release.py [PICTURE]`. It draws the pull-off force over the speed into `plan_release.png`, or
the file named.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from bem import StandardLinearSolid
from bem.lab import Setup
from bem.lab.units import readable
from bem.plots import COLOURS, PULL_OFF
from bem.reference_solutions.jkr import PULL_OFF_FORCE

LENS = Setup(
    radius=3.5e-3,
    work_of_adhesion=0.05,
    relaxed_modulus=2e6,
    retardation_time=0.1,
    material=StandardLinearSolid(modulus_ratio=0.1),
)
HOLD, LET_GO = 5e-3, 1e-3  # N
SPEEDS = (1e-8, 1e-2)  # m/s
DEPTH, LOADING, DWELL = 10e-6, 10e-6, 1.0  # m, m/s, s


def pull_off_force(speed: float, setup: Setup = LENS, dwell: float = DWELL) -> float:
    """Pull-off force in N after a slow approach and a dwell, at a retraction speed in m/s."""
    protocol = setup.protocol(
        peak_indentation=DEPTH,
        loading_rate=LOADING,
        dwell_time=dwell,
        unloading_rate=speed,
        start_indentation=-3 * DEPTH,
    )
    return setup.simulate(protocol, "draft", check_range=False).pull_off_force


def speed_for(force: float) -> float:
    """Retraction speed, in m/s, at which the pull-off force is `force`, in N.

    Raises:
        ValueError: no speed in the range gives that force.
    """
    low, high = (pull_off_force(speed) for speed in SPEEDS)
    if not low < force < high:
        raise ValueError(f"force must lie between {low:.3g} and {high:.3g} N, what the speeds give; received {force!r}")
    logarithm = brentq(lambda x: np.log(pull_off_force(np.exp(x)) / force), *np.log(SPEEDS), xtol=0.02)
    return float(np.exp(logarithm))


def draw(planned: dict[float, float], path: str | Path) -> None:
    """Pull-off force over speed, with the planned speed of each force."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import EngFormatter

    figure = Figure(figsize=(5.5, 3.8), layout="constrained")
    axes = figure.subplots()
    speeds = np.geomspace(*SPEEDS, 25)
    axes.loglog(speeds, [pull_off_force(speed) for speed in speeds], color=COLOURS["solver"], linewidth=1.2)
    at_rest = PULL_OFF_FORCE * LENS.force_scale
    axes.axhline(at_rest, color="0.6", linewidth=0.8)
    axes.annotate("elastic", (SPEEDS[1], at_rest), xytext=(0, 3), textcoords="offset points", ha="right", color="0.4")
    for force, speed in planned.items():
        axes.plot(speed, force, "o", color=PULL_OFF, markersize=5)
        # With the micro sign of the axes.
        words = f"{readable(force, 'N')} at {readable(speed, 'm/s')}".replace(" u", " µ")
        axes.annotate(words, (speed, force), xytext=(8, -4), textcoords="offset points", color=PULL_OFF)
    axes.xaxis.set_major_formatter(EngFormatter("m/s"))
    axes.yaxis.set_major_formatter(EngFormatter("N"))
    axes.set_yticks([1e-3, 2e-3, 5e-3])
    axes.yaxis.set_minor_formatter(lambda *_: "")
    axes.set(xlabel="speed of retraction", ylabel="pull-off force")
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=150)


def main(path: str | Path = "plan_release.png") -> None:
    """Answer the question, show what a change of dwell does to the answer, and draw it."""
    hold, let_go = speed_for(HOLD), speed_for(LET_GO)
    print(f"to hold {readable(HOLD, 'N')}: retract faster than {readable(hold, 'm/s')}")
    print(f"to let go below {readable(LET_GO, 'N')}: retract slower than {readable(let_go, 'm/s')}")
    for dwell in (0.0, 0.1, 1.0):
        print(f"dwell {readable(dwell, 's'):>6}: pull-off {readable(pull_off_force(hold, dwell=dwell), 'N')}")
    print(f"these speeds belong to an effective range of adhesion of {readable(LENS.gap, 'm')}")
    draw({HOLD: hold, LET_GO: let_go}, path)


if __name__ == "__main__":
    main(*sys.argv[1:2])
