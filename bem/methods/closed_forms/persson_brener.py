"""Persson and Brener: effective surface energy of a crack in a standard linear solid against its velocity.

Gamma is the effective over the thermodynamic surface energy, between 1 and 1/k; the velocity is normalised by l0 over
the retardation time, l0 = E0* dgamma / (pi (alpha sigma_0)^2); k = E0/Einf. With x = Gamma / (2 pi v),

    Gamma = 1 / (1 - (1 - k) (sqrt(1 + x^2) - x)).

Source: paper, appendix "Exact Persson & Brener relation for the SLS", Eqs. (implicit) and (inverse); Persson and
Brener, Phys. Rev. E 71 (2005) 036123; Ciavarella, Cricri and McMeeking, Theor. Appl. Fract. Mech. 116 (2021) 103113.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import expit

from bem._support.validation import FloatArray
from bem._support.wording import shown


def _checked(velocity: ArrayLike, modulus_ratio: ArrayLike) -> tuple[FloatArray, FloatArray]:
    v, k = np.broadcast_arrays(np.asarray(velocity, dtype=np.float64), np.asarray(modulus_ratio, dtype=np.float64))
    if not np.all((v >= 0.0) & np.isfinite(v)):
        raise ValueError(f"crack_velocity must be finite and at least 0; received {shown(velocity)}")
    if not np.all((k > 0.0) & (k <= 1.0)):
        raise ValueError(f"modulus_ratio must be greater than 0 and at most 1; received {shown(modulus_ratio)}")
    return v, k


def effective_energy(crack_velocity: ArrayLike, modulus_ratio: ArrayLike) -> FloatArray:
    """Normalised effective surface energy by the implicit relation; shapes broadcast.

    With s = sqrt(1 + x^2) - x in (0, 1) the relation reads pi v = s / ((1 - s^2) (1 - (1 - k) s)), whose right side
    increases with s: bisection on the logit of s finds the one root with all digits, whether s is close to 0 or to 1.

    Raises:
        ValueError: for a negative velocity or a modulus ratio outside (0, 1].
    """
    v, k = _checked(crack_velocity, modulus_ratio)
    low, high = np.full(v.shape, -700.0), np.full(v.shape, 700.0)
    for _ in range(64):
        middle = 0.5 * (low + high)
        s, complement = expit(middle), expit(-middle)
        too_slow = s < np.pi * v * complement * (1.0 + s) * (k + (1.0 - k) * complement)
        low, high = np.where(too_slow, middle, low), np.where(too_slow, high, middle)
    return 1.0 / (k + (1.0 - k) * expit(-0.5 * (low + high)))


def crack_velocity(effective_energy: ArrayLike, modulus_ratio: ArrayLike) -> FloatArray:
    """Normalised crack velocity at a normalised effective energy in [1, 1/k); infinite at 1/k; shapes broadcast.

    Raises:
        ValueError: for a modulus ratio outside (0, 1) or an energy outside [1, 1/k].
    """
    gamma, k = np.broadcast_arrays(
        np.asarray(effective_energy, dtype=np.float64), np.asarray(modulus_ratio, dtype=np.float64)
    )
    if not np.all((k > 0.0) & (k < 1.0)):
        raise ValueError(f"modulus_ratio must be greater than 0 and less than 1; received {shown(modulus_ratio)}")
    if not np.all((gamma >= 1.0) & (gamma * k <= 1.0)):
        raise ValueError(f"effective_energy must lie between 1 and 1/modulus_ratio; received {shown(effective_energy)}")
    c, g = 1.0 - k, gamma - 1.0
    top = c * gamma**2 * g
    bottom = np.pi * (1.0 - k * gamma) * (c * gamma + g)
    return np.divide(top, bottom, out=np.full(top.shape, np.inf), where=bottom > 0.0)


def length_scale(tabor: ArrayLike, *, radius_over_gap: float = 100.0, alpha: float = np.pi / 9.0) -> FloatArray:
    """Length l0 over h0 at a Tabor parameter, with sigma_0 the largest Lennard-Jones traction; 4.252 at mu = 3.24.

    Multiplies a velocity in l0 per retardation time to give one in h0 per retardation time.
    """
    stress = 9.0 * np.sqrt(3.0) / 16.0
    return stress**2 * np.sqrt(radius_over_gap) / (np.asarray(tabor, dtype=np.float64) ** 1.5 * np.pi * alpha**2)


def beta_over_length_scale(tabor: float) -> float:
    """Ratio of the contact's unit of length, beta, to the theory's, l0, whatever the radius over the gap."""
    return float(np.sqrt(100.0 * tabor) / length_scale(tabor))
