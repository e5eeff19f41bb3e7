"""Which effects a fitted curve calls for: the fewest that give its force to within the noise."""

from __future__ import annotations

import numpy as np

from bem.effects.recommendation import recommend
from bem.effects.scene_effects import Effects
from bem.lab.fitting.model import Model
from bem.lab.fitting.result import FitResult

_SHARE = 0.5  # of the noise, that leaving an effect out may change the force by


def effects_called_for(result: FitResult) -> Effects:
    """The fewest effects that describe a fitted curve, by `bem.recommend` on the fitted contact and the measured path.

    What is left out changes the force by less than half of the noise, root mean square.
    """
    model = Model(result.measured, result.setup)
    protocol, _ = model.protocol(result.setup, result.values.get("contact_point", 0.0))
    tolerance = float(np.clip(_SHARE * result.noise / np.ptp(result.curve.force), 1e-3, 1.0))
    return recommend(result.setup.scene(), protocol, tolerance, best="fewest").effects


def sentence(effects: Effects) -> str:
    """What these effects mean for the fitted parameters, in words."""
    words = f"The curve calls for these effects: {effects}."
    if not effects.adhesion:
        words += " Adhesion stays below the noise, so that Hertz describes it and the work of adhesion is a bound."
    if effects.of and effects.terms == 0 and effects.first == 0:
        words += " The contact stays glassy: relaxed modulus and modulus ratio are known as a quotient only."
    return words
