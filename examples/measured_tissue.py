"""Fit a measured force curve: a bead on nervous tissue, and what the model of this package does not describe in it.

A polystyrene bead of 37 micrometres on a soft cantilever was pressed into the gray matter of a zebrafish spinal cord
section and withdrawn, in liquid. `measured_tissue.csv` names the source of the curve; its licence is in
`measured_tissue.LICENSE`. The ladder of models is climbed up to the solver, which finds modulus, work of adhesion,
relaxation, contact point, offset, tilt and drag at once. Hertz's formula on the approach alone gives one apparent
modulus; nanite, whose authors published the curve, finds 57.6 Pa for it so.

The loop of loading and unloading is described in the large. The fit says that no model is adequate, because the surface
is felt before it carries load, and threads of tissue hold on after the contact has opened. In place of intervals it
gives the spread of Hertz's modulus over windows of depth.

Run: `python examples/measured_tissue.py [PICTURE]` (needs the extra `lab`). It draws curve, fit and residuals into
`measured_tissue.png`, or the file named.
"""

from __future__ import annotations

import sys
from pathlib import Path

from bem._support.command_line import one_sentence
from bem._support.outputs import IMAGES, require_output, require_suffix
from bem.lab import FitResult, ForceCurve, fit
from bem.lab.fitting import guess_setup
from bem.lab.units import readable

CURVE = Path(__file__).with_name("measured_tissue.csv")
RADIUS, STIFFNESS = 18.64e-6, 0.010950848  # m, N/m


def read() -> ForceCurve:
    """The measured curve."""
    return ForceCurve.read(CURVE, stiffness=STIFFNESS, force_sign="compression")


def apparent_modulus(curve: ForceCurve) -> FitResult:
    """Hertz on the approach alone."""
    return fit(curve, guess_setup(curve, radius=RADIUS), model="hertz", segment="approach")


def fitted(curve: ForceCurve, accuracy: str | float = "standard") -> FitResult:
    """Everything the curve calls for, fitted."""
    return fit(curve, guess_setup(curve, radius=RADIUS), accuracy=accuracy)


def main(path: str | Path = "measured_tissue.png") -> None:
    """Fit, print, draw."""
    require_suffix(path, IMAGES)
    require_output(path)
    curve = read()
    result = fitted(curve)
    print(result.summary())
    hertz = apparent_modulus(curve)
    low, high = (readable(end, "Pa") for end in hertz.intervals["relaxed_modulus"])
    alone = readable(hertz.values["relaxed_modulus"], "Pa")
    print(f"Hertz on the approach alone: {alone}, between {low} and {high} over windows of depth.")
    result.plot(path)


if __name__ == "__main__":
    with one_sentence("measured_tissue"):
        main(*sys.argv[1:2])
