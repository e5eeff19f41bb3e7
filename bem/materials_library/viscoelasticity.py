"""Linear viscoelasticity of the solver's materials: storage and loss moduli, relaxation spectra, fits and shifts.

The materials are series of retardation: E0 C(t) = 1 - sum_i c_i exp(-t / tau_i). Laboratories measure relaxation,
E(t)/E0 = 1 + sum_i g_i exp(-t / t_i), or storage and loss moduli, E' + i E'' = E0 / (E0 C*), with

    E0 C*(omega) = 1 - sum_i c_i i omega tau_i / (1 + i omega tau_i).

Both series have as many terms, and their times interlace: t_1 < tau_1 < t_2 < tau_2 ... Source: Gross, Mathematical
Structure of the Theories of Viscoelasticity (1953); Ferry, Viscoelastic Properties of Polymers (1980), chapters 3 and
11.

Units: moduli relative to the relaxed modulus E0 unless one is given; frequencies are angular, in rad per unit of the
material's times.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import nnls

from bem._support.validation import FloatArray, finite_number, finite_vector, strictly_increasing
from bem._support.wording import shown
from bem.problem.materials import Elastic, Material, PronySeries
from bem.problem.materials import relaxation_spectrum as relaxation_spectrum

_PER_DECADE = 1.0
_MARGIN = 3.0  # times the inverse frequencies measured, within which relaxation times are sought


def complex_modulus(material: Material, frequency: ArrayLike) -> np.ndarray:
    """E* / E0 at angular frequencies >= 0 of any shape: storage modulus plus i times loss modulus."""
    omega = 1j * np.asarray(frequency, dtype=np.float64)[..., np.newaxis] * material.times
    return 1.0 / (1.0 - np.sum(material.strengths * omega / (1.0 + omega), axis=-1))


def storage_modulus(material: Material, frequency: ArrayLike, relaxed_modulus: float = 1.0) -> FloatArray:
    """Storage modulus E' at angular frequencies of any shape, from E0 at rest to E0 over the modulus ratio."""
    return relaxed_modulus * complex_modulus(material, frequency).real


def loss_modulus(material: Material, frequency: ArrayLike, relaxed_modulus: float = 1.0) -> FloatArray:
    """Loss modulus E'' at angular frequencies of any shape, zero at rest and at infinity."""
    return relaxed_modulus * complex_modulus(material, frequency).imag


@dataclass(frozen=True)
class PronyFit:
    """A series fitted to storage and loss moduli."""

    material: PronySeries | Elastic
    """Its times are in the unit of one over the frequencies."""
    relaxed_modulus: float
    """E0, in the unit of the moduli."""
    relative_error: float
    """Root mean square of the relative errors of both moduli."""


def fit_prony(frequency: ArrayLike, storage: ArrayLike, loss: ArrayLike, *, terms: int | None = None) -> PronyFit:
    """Fit a Prony series to measured storage and loss moduli, by non-negative least squares of relative errors.

    Relaxation times are spaced evenly on a logarithmic scale over the measured window; strengths that come out zero are
    dropped. The relaxed modulus is what the fit leaves at rest: where the lowest frequency is not slow enough to see
    it, it is an extrapolation.

    Args:
        frequency: angular frequencies, increasing, shape (n,). A frequency in Hz times 2 pi.
        storage, loss: moduli at them, positive, in one unit.
        terms: number of times; by default one a decade.

    Returns:
        The material, its relaxed modulus in the unit of the moduli, and how well it fits.

    Raises:
        ValueError: fewer than three frequencies, values that are not positive, or moduli that belong to no solid.
    """
    omega = strictly_increasing("frequency", finite_vector("frequency", frequency, at_least=3))
    moduli = [finite_vector(name, values, at_least=3) for name, values in (("storage", storage), ("loss", loss))]
    for name, values in zip(("frequency", "storage", "loss"), (omega, *moduli), strict=True):
        if len(values) != len(omega):
            raise ValueError(f"{name} must have as many values as frequency; received {len(values)} and {len(omega)}")
        if np.any(values <= 0.0):
            raise ValueError(f"{name} must be greater than 0; received {float(values.min())!r}")
    decades = np.log10(omega[-1] / omega[0]) + 2.0 * np.log10(_MARGIN)
    count = max(int(np.ceil(_PER_DECADE * decades)), 1) if terms is None else terms
    if not 1 <= count <= 100:
        raise ValueError(f"terms must be a whole number from 1 to 100; received {shown(terms)}")
    times = np.geomspace(1.0 / (_MARGIN * omega[-1]), _MARGIN / omega[0], count)
    phase = omega[:, np.newaxis] * times
    real = np.column_stack([np.ones_like(omega), phase**2 / (1.0 + phase**2)])
    imaginary = np.column_stack([np.zeros_like(omega), phase / (1.0 + phase**2)])
    measured = np.concatenate(moduli)
    matrix = np.vstack([real, imaginary])
    weights, _ = nnls(matrix / measured[:, np.newaxis], np.ones_like(measured))
    if not weights[0] > 1e-12 * weights.max():
        raise ValueError(
            "the moduli are those of a fluid: no relaxed modulus is left at rest; received no lower frequency"
        )
    error = float(np.sqrt(np.mean((matrix @ weights / measured - 1.0) ** 2)))
    kept = weights[1:] > 0.0
    material = PronySeries.from_moduli(weights[1:][kept] / weights[0], times[kept]) if np.any(kept) else Elastic()
    return PronyFit(material, float(weights[0]), error)


def wlf_shift(temperature: float, *, reference: float, c1: float, c2: float) -> float:
    """The factor by which relaxation times change from a reference temperature to another (Williams, Landel and Ferry).

    log10 a = -c1 (T - Tr) / (c2 + T - Tr). Temperatures in one scale, kelvin or degrees Celsius, as c2.

    Raises:
        ValueError: a temperature at or below Tr - c2, where the equation has its pole.
    """
    c1, c2 = finite_number("c1", c1, above=0.0), finite_number("c2", c2, above=0.0)
    reference = finite_number("reference", reference)
    difference = finite_number("temperature", temperature, above=reference - c2) - reference
    return float(10.0 ** (-c1 * difference / (c2 + difference)))


def shifted(material: Material, factor: float) -> PronySeries | Elastic:
    """The material with all its times multiplied by a shift factor, as of `wlf_shift`."""
    factor = finite_number("factor", factor, above=0.0)
    if material.times.size == 0:
        return Elastic()
    return PronySeries(material.strengths, factor * np.asarray(material.times))
