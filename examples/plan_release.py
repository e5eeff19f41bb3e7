"""Plan an experiment in newtons and seconds: how fast to retract to hold one force, or to let go below another.

A glass lens is pressed into a soft viscoelastic solid and withdrawn. Pulled fast it holds more than it would at rest,
as the edge of the contact dissipates; pulled slowly it lets go. The answer is two speeds: the slowest retraction that
holds, and the fastest that still lets go.

Run: `python examples/plan_release.py`.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from bem import StandardLinearSolid
from bem.lab import Setup
from bem.lab.units import readable

LENS = Setup(
    radius=20e-3,
    work_of_adhesion=0.05,
    relaxed_modulus=2e6,
    retardation_time=0.1,
    material=StandardLinearSolid(modulus_ratio=0.1),
)
HOLD, LET_GO = 10e-3, 6e-3  # N
SPEEDS = (1e-7, 1e-1)  # m/s
DEPTH, LOADING, DWELL = 20e-6, 20e-6, 1.0  # m, m/s, s


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


def main() -> None:
    """Answer the question, and show what a change of dwell does to the answer."""
    hold, let_go = speed_for(HOLD), speed_for(LET_GO)
    print(f"to hold {readable(HOLD, 'N')}: retract faster than {readable(hold, 'm/s')}")
    print(f"to let go below {readable(LET_GO, 'N')}: retract slower than {readable(let_go, 'm/s')}")
    for dwell in (0.0, 0.1, 1.0):
        print(f"dwell {readable(dwell, 's'):>6}: pull-off {readable(pull_off_force(hold, dwell=dwell), 'N')}")


if __name__ == "__main__":
    main()
