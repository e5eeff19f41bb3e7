"""Random linear solids of a design: the stated prior of their spectra.

The creep compliance of a solid is E0 C(t) = 1 - (1 - k) sum_i s_i exp(-t / tau_i), k the modulus ratio, which the
design draws, and s_i shares that add up to one. The unit of time is the geometric mean of the retardation times
weighted by the shares, so that a solid of one term is a standard linear solid of retardation time 1.

- `prony`: any number of terms in a range is as likely as another. Shares are uniform on their simplex (a Dirichlet
  distribution of concentration 1), none below `LEAST_SHARE`; logarithms of times are uniform over four decades.
- `broad`: the same, but over a number of decades that is itself uniform from 3 to 9, as in measured spectra.
- `power-law`: the times are evenly spaced in their logarithm over 3 to 6 decades, and shares grow as their power beta,
  -0.1 to 0.5: the creep of a power law with cut-offs.
- a spectrum of your own, the same for all trajectories.

Solid i depends on prior and seed only, as protocols do. Times are in retardation times.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bem._support.validation import FloatArray, finite_vector, whole_number
from bem._support.wording import shown
from bem.problem.materials import Elastic, PronySeries

PRIORS = {"prony": (1, 4), "broad": (2, 12), "power-law": (8, 12)}
"""Kinds of random solids, with their least and largest number of terms."""
MOST_TERMS = 100
LEAST_SHARE = 0.01
_DECADES = 4.0  # over which logarithms of times are drawn
_BROAD = (3.0, 9.0)  # the same of `broad`: the range of their number
_SPANS, _POWERS = (3.0, 6.0), (-0.1, 0.5)  # of power laws: decades of their times, and beta


@dataclass(frozen=True)
class Solids:
    """Where the spectra of a design come from.

    Args:
        prior: one of `PRIORS`, or 'spectrum' for `shares` and `times` of your own.
        terms: least and largest number of terms; those of the prior by default.
        shares: of the retardation strength, positive, with a sum of one up to rounding, shape (m,).
        times: retardation times in any unit, shape (m,).

    Raises:
        ValueError: naming the quantity, the allowed range and the value received.

    Examples:
        >>> shares, times = Solids("prony", (2, 3)).draw(5, seed=1)
        >>> shares.shape, bool(abs(shares.sum(axis=1) - 1.0).max() < 1e-12)
        ((5, 3), True)
    """

    prior: str = "prony"
    terms: tuple[int, int] = (0, 0)
    shares: tuple[float, ...] = ()
    times: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.prior == "spectrum":
            solid = PronySeries(0.5 * finite_vector("shares", self.shares, at_least=1), self.times)
            if not np.isclose(total := 2.0 * solid.strengths.sum(), 1.0, rtol=1e-9):
                raise ValueError(f"shares must have a sum of 1; received a sum of {float(total)!r}")
            terms = (len(solid.times),) * 2
            object.__setattr__(self, "shares", tuple((2.0 * solid.strengths).tolist()))
            object.__setattr__(self, "times", tuple(solid.times.tolist()))
        elif self.prior in PRIORS:
            low, high = PRIORS[self.prior] if tuple(self.terms) == (0, 0) else self.terms
            low = whole_number("terms", low, low=1, high=MOST_TERMS)
            terms = (low, whole_number("terms", high, low=low, high=MOST_TERMS))
        else:
            raise ValueError(f"solids must be one of {', '.join(PRIORS)} or a spectrum; received {shown(self.prior)}")
        object.__setattr__(self, "terms", terms)

    @classmethod
    def of(cls, identity: str | Mapping[str, Any]) -> "Solids":
        """The solids of an `identity`, or of a text such as `prony` or `prony:1-4`.

        Raises:
            ValueError: it describes none.
        """
        if not isinstance(identity, str):
            return cls("spectrum", shares=tuple(identity["shares"]), times=tuple(identity["times"]))
        prior, _, terms = identity.partition(":")
        low, _, high = terms.partition("-")
        try:
            return cls(prior, (int(low), int(high or low)) if terms else (0, 0))
        except ValueError as error:
            if "received" in str(error):
                raise
            raise ValueError(f"terms must read LOW-HIGH, e.g. prony:1-4; received {shown(identity)}") from None

    @property
    def identity(self) -> str | dict[str, list[float]]:
        """What determines the draws, ready for JSON."""
        if self.prior == "spectrum":
            return {"shares": list(self.shares), "times": list(self.times)}
        return f"{self.prior}:{self.terms[0]}-{self.terms[1]}"

    def draw(self, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
        """Shares and times of `count` solids, (count, m) each with the times increasing; unused terms are 0 and 1."""
        most = self.terms[1]
        unit = np.random.default_rng([seed, 1]).random((count, 2 * most + 1))
        drawn = self.terms[0] + (unit[:, -1:] * (most - self.terms[0] + 1)).astype(int)
        used = np.arange(most) < drawn
        if self.prior == "spectrum":
            shares, decades = np.tile(self.shares, (count, 1)), np.tile(np.log10(self.times), (count, 1))
        elif self.prior in ("prony", "broad"):
            span = np.full((count, 1), _DECADES)
            if self.prior == "broad":
                span = _BROAD[0] + (_BROAD[1] - _BROAD[0]) * np.random.default_rng([seed, 2]).random((count, 1))
            shares = np.where(used, -np.log1p(-unit[:, :most]), 0.0)
            shares = np.where(used, np.maximum(shares / shares.sum(axis=1, keepdims=True), LEAST_SHARE), 0.0)
            decades = np.sort(np.where(used, span * unit[:, most:-1], np.inf), axis=1)
        else:
            span = _SPANS[0] + (_SPANS[1] - _SPANS[0]) * unit[:, :1]
            decades = span * np.arange(most) / np.maximum(drawn - 1, 1)
            power = _POWERS[0] + (_POWERS[1] - _POWERS[0]) * unit[:, 1:2]
            shares = np.where(used, 10.0 ** (power * decades), 0.0)
        shares = shares / shares.sum(axis=1, keepdims=True)
        decades = np.where(used, decades, 0.0)
        decades -= np.sum(shares * decades, axis=1, keepdims=True)
        return shares, np.where(used, 10.0**decades, 1.0)


def solid_of(strengths: FloatArray, times: FloatArray) -> PronySeries | Elastic:
    """The solid of retardation strengths and times (m,), of which some strengths may be zero."""
    return PronySeries(strengths[strengths > 0.0], times[strengths > 0.0]) if strengths.any() else Elastic()
