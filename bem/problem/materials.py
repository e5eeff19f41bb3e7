"""Linear viscoelastic half-spaces: creep compliance and the exact recursion that replaces the hereditary integral.

Every material is described by retardation strengths c_i and times tau_i with

    E0 C(t) = 1 - sum_i c_i exp(-t / tau_i),

E0 the relaxed modulus, so that the fully relaxed compliance is 1 and the instantaneous one k = 1 - sum_i c_i, the
modulus ratio E0/Einf. Times are in units of the retardation time that also scales the protocol. The displacement is
then u = mu G (sigma - sum_i c_i q_i) with one memory vector q_i = int exp(-(t - s)/tau_i) dsigma(s) per term, and for a
traction linear over a step of length dt

    q_i(t + dt) = e_i q_i(t) + phi_i (sigma(t + dt) - sigma(t)),
    e_i = exp(-dt/tau_i),  phi_i = (1 - e_i) tau_i / dt,

exactly, whatever dt. Source: paper, Eqs. (creep compliance) and (displacement); Christensen, Theory of Viscoelasticity
(1982), section 1.2; interconversion after Gross, Mathematical Structure of the Theories of Viscoelasticity (1953).
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from bem._support.jit import kernel
from bem._support.validation import FloatArray, Valued, finite_number, finite_vector
from bem._support.wording import shown

_NARROWEST = -700.0  # logarithm of the smallest distance from a pole, short of underflow


def _read_only(values: ArrayLike) -> FloatArray:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


class Material(ABC):
    """Interface of a material to the solver; the module docstring defines strengths and times.

    Each material has its `modulus_ratio` too, relaxed over instantaneous modulus, k = E0/Einf, in (0, 1].
    """

    @property
    @abstractmethod
    def strengths(self) -> FloatArray:
        """Retardation strengths c_i, shape (m,), positive, with a sum below 1; m = 0 for an elastic solid."""

    @property
    @abstractmethod
    def times(self) -> FloatArray:
        """Retardation times tau_i, shape (m,)."""

    def creep_compliance(self, time: ArrayLike) -> FloatArray:
        """Creep compliance E0 C(t) at `time` >= 0 (any shape), between the modulus ratio and 1."""
        elapsed = np.asarray(time, dtype=np.float64)[..., np.newaxis]
        return 1.0 - np.sum(self.strengths * np.exp(-elapsed / self.times), axis=-1)


@dataclass(frozen=True)
class Elastic(Material):
    """A half-space without memory, of the relaxed modulus E0."""

    @property
    def modulus_ratio(self) -> float:
        """Relaxed and instantaneous modulus are the same."""
        return 1.0

    @property
    def strengths(self) -> FloatArray:
        """No terms."""
        return _read_only([])

    @property
    def times(self) -> FloatArray:
        """No terms."""
        return _read_only([])


@dataclass(frozen=True)
class StandardLinearSolid(Material):
    """One relaxation process: E0 C(t) = 1 - (1 - k) exp(-t), k the modulus ratio in (0, 1]; k = 1 is elastic."""

    modulus_ratio: float

    def __post_init__(self) -> None:
        value = finite_number("modulus_ratio", self.modulus_ratio, above=0.0, high=1.0)
        object.__setattr__(self, "modulus_ratio", value)

    @property
    def strengths(self) -> FloatArray:
        """The single strength 1 - k, or nothing when k = 1."""
        return _read_only([1.0 - self.modulus_ratio] if self.modulus_ratio < 1.0 else [])

    @property
    def times(self) -> FloatArray:
        """The single retardation time, which is the unit of time."""
        return _read_only([1.0] if self.modulus_ratio < 1.0 else [])


@dataclass(frozen=True, eq=False, init=False)
class PronySeries(Valued, Material):
    """A solid with a spectrum of retardation times.

    Args:
        compliances: strengths c_i >= 0 as fractions of the relaxed compliance, with a sum below 1; a term of strength
            zero is dropped.
        times: retardation times, positive and distinct, one for each strength. Terms are kept sorted by time.

    Raises:
        ValueError: for unequal lengths or values out of range.
    """

    compliances: FloatArray
    retardation_times: FloatArray

    def __init__(self, compliances: ArrayLike, times: ArrayLike) -> None:
        strengths, ordered = _checked_terms("compliances", compliances, times)
        if not np.sum(strengths) < 1.0:
            raise ValueError(f"compliances must have a sum less than 1; received a sum of {float(np.sum(strengths))!r}")
        object.__setattr__(self, "compliances", strengths)
        object.__setattr__(self, "retardation_times", ordered)

    @classmethod
    def from_moduli(cls, moduli: ArrayLike, times: ArrayLike) -> Self:
        """The same solid from its relaxation spectrum E(t)/E0 = 1 + sum_i g_i exp(-t / t_i).

        Args:
            moduli: relaxation strengths g_i >= 0 relative to the relaxed modulus E0, shape (m,).
            times: relaxation times t_i, positive and distinct, shape (m,).

        Returns:
            The series with the retardation strengths and times of the same solid.
        """
        amounts, relaxations = _checked_terms("moduli", moduli, times)
        # As s^2 E(s) C(s) = 1, the retardation times T are the m roots of 1 - sum_i g_i t_i / (T - t_i), one above each
        # relaxation time. No pole closes the last interval: its end lies so far out that the root is in its left half.
        weights = amounts * relaxations
        ends = np.append(relaxations, 2.0 * relaxations[-1:] + 4.0 * np.sum(weights))
        return cls(*_poles(weights, relaxations, ends))

    @property
    def modulus_ratio(self) -> float:
        """Relaxed over instantaneous modulus, 1 - sum of the strengths."""
        return float(1.0 - np.sum(self.compliances))

    @property
    def strengths(self) -> FloatArray:
        """Retardation strengths, shape (m,)."""
        return self.compliances

    @property
    def times(self) -> FloatArray:
        """Retardation times, increasing, shape (m,)."""
        return self.retardation_times

    def __repr__(self) -> str:
        return f"PronySeries(compliances={self.strengths.tolist()}, times={self.times.tolist()})"


def _checked_terms(name: str, amounts: ArrayLike, times: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Validated terms sorted by time, those of amount zero dropped; read-only, both of shape (m,)."""
    amount, time = finite_vector(name, amounts), finite_vector("times", times)
    if len(amount) != len(time):
        raise ValueError(f"{name} and times must have the same length; received {len(amount)} and {len(time)}")
    if np.any(amount < 0.0):
        raise ValueError(f"{name} must be at least 0; received {float(amount.min())!r}")
    if np.any(time <= 0.0):
        raise ValueError(f"times must be greater than 0; received {float(time.min())!r}")
    order = np.argsort(time)
    amount, time = amount[order], time[order]
    if np.any(np.diff(time) == 0.0):
        raise ValueError(f"times must be distinct; received {shown(time.tolist())}")
    return _read_only(amount[amount > 0.0]), _read_only(time[amount > 0.0])


def relaxation_spectrum(material: Material) -> tuple[FloatArray, FloatArray]:
    """Relaxation strengths g_i (over E0) and times t_i, shape (m,), of E(t)/E0 = 1 + sum_i g_i exp(-t / t_i).

    The inverse of `PronySeries.from_moduli`. The times are the roots t of 1 - sum_i c_i tau_i / (tau_i - t), one below
    each retardation time; the residues give g = 1 / sum_i c_i tau_i t / (tau_i - t)^2.
    """
    times = material.times
    residues, roots = _poles(-material.strengths * times, times, np.append(0.0, times))
    return -residues, roots


def _poles(weights: FloatArray, poles: FloatArray, ends: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Amounts 1 / (x sum_i w_i / (x - p_i)^2) at the roots x of 1 = sum_i w_i / (x - p_i), and these, (n,) each.

    One root lies between any two neighbouring ends. It is sought as its distance from the nearer end, on a logarithmic
    scale, and the distances from all poles follow from that one: spectra spanning many decades lose no digits.
    """
    # Imported here because scipy.optimize takes a noticeable part of a second.
    from scipy.optimize import brentq

    roots, distances = np.empty(poles.size), np.empty((poles.size, poles.size))
    for j in range(poles.size):
        left, right = ends[j], ends[j + 1]
        middle = left + 0.5 * (right - left)
        at_left = (np.sum(weights / (middle - poles)) < 1.0) == (weights[j] > 0.0)
        end, sign = (left, 1.0) if at_left else (right, -1.0)
        offsets = end - poles

        def balance(log_distance: float, offsets: FloatArray = offsets, sign: float = sign) -> float:
            return 1.0 - float(np.sum(weights / (offsets + sign * np.exp(log_distance))))

        widest = np.log(0.5 * (right - left))
        narrowest = widest - 1.0
        while (balance(narrowest) > 0.0) == (balance(widest) > 0.0) and narrowest > _NARROWEST:
            narrowest -= 5.0
        distance = sign * np.exp(brentq(balance, narrowest, widest, xtol=1e-15, rtol=1e-15))
        roots[j], distances[j] = end + distance, offsets + distance
    return 1.0 / (roots * np.sum(weights / distances**2, axis=1)), roots


@kernel
def recursion_step(dt: float, time: float) -> tuple[float, float]:
    """Decay e and gain phi of one term with retardation time `time` over a step `dt` >= 0; phi -> 1 as dt -> 0."""
    ratio = dt / time
    if ratio == 0.0:
        return 1.0, 1.0
    return np.exp(-ratio), -np.expm1(-ratio) / ratio
