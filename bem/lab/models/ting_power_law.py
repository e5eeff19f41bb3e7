"""Ting with a power law: a sphere on a half-space whose modulus falls as E(t) = E1 (t / 1 s)^(-exponent).

The power law is a sum of exponentials with times a factor apart, the trapezoidal rule of its Laplace integral in the
logarithm of the rate, which converges exponentially; rates too slow for the curve count as an elastic rest.
"""

import numpy as np
from scipy.special import gamma

from bem.lab.models.model import Parameter, Values
from bem.lab.models.path import Path
from bem.lab.models.ting import Relaxation, Relaxing

MODULUS_AT_1S = Parameter("modulus_at_1s", "Pa", "logarithm", 1e0, 1e12, "a deeper indentation")
EXPONENT = Parameter("exponent", "", "logit", 1e-3, 0.98, "a dwell and ramps of different lengths")
_STEP = 1.2  # of the logarithm of the rate
_FASTEST, _SLOWEST = 10.0, 0.03  # rates, over that of the shortest step and of the whole curve


def relaxation(values: Values, path: Path) -> Relaxation:
    """Terms between the shortest step of the path and its duration."""
    steps = np.diff(path.time)
    fastest, slowest = _FASTEST / float(np.median(steps)), _SLOWEST / float(np.ptp(path.time))
    logarithms = np.arange(np.log(slowest), np.log(fastest), _STEP)
    alpha, modulus = values["exponent"], values["modulus_at_1s"] / (1.0 - path.setup.poisson_ratio**2)
    rest = np.exp(alpha * (logarithms[0] - 0.5 * _STEP)) / alpha
    strengths = modulus / gamma(alpha) * _STEP * np.exp(alpha * logarithms)
    return modulus / gamma(alpha) * rest, strengths, np.exp(-logarithms)


MODEL = Relaxing(
    name="ting_power_law",
    title="Ting: viscoelastic sphere without adhesion, power law",
    parameters=(MODULUS_AT_1S, EXPONENT),
    assumptions=(
        "The modulus falls as a power of time.",
        "The surfaces do not attract each other.",
        "The depth is small beside R.",
    ),
    source="Ting, J. Appl. Mech. 33 (1966) 845; Efremov et al., Sci. Rep. 7 (2017) 1541",
    relaxes=True,
    difference=1e-3,
    relaxation=relaxation,
)
