"""Fit a measured force curve: a bead on nervous tissue, and what the model of this package does not describe in it.

A polystyrene bead of 37 micrometres on a soft cantilever was pressed into the gray matter of a zebrafish spinal cord
section and withdrawn, in liquid. `measured_tissue.csv` names the source of the curve; its licence is in
`measured_tissue.LICENSE`. The fit knows the cantilever and finds modulus, work of adhesion, relaxation, contact point
and offset at once. Hertz's formula on the deep part of the approach alone gives one apparent modulus; nanite, whose
authors published the curve, finds 57.6 Pa for it so.

The loop of loading and unloading is described; three things are not, and the fit says that its residuals are far above
the noise: the surface is felt before it carries load, threads of tissue hold on after the contact has opened, and the
liquid drags on the cantilever, so that the baselines of approach and retraction differ.

Run: `python examples/measured_tissue.py [PICTURE]` (needs the extra `lab`). It draws curve, fit and residuals into
`measured_tissue.png`, or the file named.
"""

from __future__ import annotations

import sys
from pathlib import Path

from bem.lab import FitResult, ForceCurve, fit
from bem.lab.guess import deep_contact, first_contact, guess_setup
from bem.lab.units import readable

CURVE = Path(__file__).with_name("measured_tissue.csv")
RADIUS, STIFFNESS = 18.64e-6, 0.010950848  # m, N/m


def read() -> ForceCurve:
    """The measured curve."""
    return ForceCurve.read(CURVE, stiffness=STIFFNESS, force_sign="compression")


def apparent_modulus(curve: ForceCurve) -> float:
    """Young's modulus, in Pa, for nu = 1/2, that Hertz gives the deep part of the approach.

    Raises:
        ValueError: the approach has no deep part.
    """
    found = deep_contact(curve, first_contact(curve), RADIUS)
    if found is None:
        raise ValueError("the curve must have an approach that grows; received one that does not")
    return 0.75 * found[1]


def fitted(curve: ForceCurve, accuracy: str | float = "standard") -> FitResult:
    """Everything the curve calls for, fitted."""
    return fit(curve, guess_setup(curve, radius=RADIUS), accuracy=accuracy)


def main(path: str | Path = "measured_tissue.png") -> None:
    """Fit, print, draw."""
    curve = read()
    result = fitted(curve)
    print(result.summary())
    at_once = result.values["relaxed_modulus"] / result.values["modulus_ratio"]
    print(f"Instantaneous modulus {readable(at_once, 'Pa')}; Hertz alone, {readable(apparent_modulus(curve), 'Pa')}.")
    result.plot(path)


if __name__ == "__main__":
    main(*sys.argv[1:2])
