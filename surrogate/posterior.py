"""Posterior of parameters from a measured curve, by weighted samples of a model that predicts thousands of curves.

The prior is uniform in the logarithms of the parameters, and the noise is Gaussian. A surrogate's own error belongs to
the likelihood: its differences from the solver at some parameters near the answer have a mean and a covariance, and
what is measured differs from the prediction by such an error and by the noise. Samples come from a Student
distribution, which `search` fits in stages of growing powers of the likelihood. Their weights make them samples of the
exact posterior.

Sources: J. Kaipio and E. Somersalo, J. Comput. Appl. Math. 198 (2007) 493 (approximation error); O. Cappe, A. Guillin,
J. M. Marin and C. P. Robert, J. Comput. Graph. Stat. 13 (2004) 907 (fitted proposals); L. Kish, Survey Sampling (1965)
(effective sample size).

Example: `docs/tutorials/8_infer_a_material.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, multivariate_t

FREEDOM = 6.0
"""Degrees of freedom of a proposal, whose tails then are wider than those of a posterior near a Gaussian."""
WIDER = 1.2
"""Width of a proposal, relative to the sample to which it is fitted."""
STAGE = 4096
"""Samples of a stage of the search."""
LEAST = STAGE / 16
"""Effective number of samples that a stage needs before the next proposal is fitted to them."""
MOST_STAGES = 20
POWERS = 0.5 ** np.arange(50.0)
"""Powers of the likelihood among which a stage takes the largest that it can."""
BATCH = 1024
"""Curves that are computed at a time."""

Map = Callable[[np.ndarray], np.ndarray]
"""A model predicts curves of shape (n, m) for logarithms of parameters (n, p), a likelihood has logarithms for them."""
Bounds = Mapping[str, tuple[float, float]]
"""Lower and upper bound by the name of the parameter, above zero; the prior is uniform between their logarithms."""


def likelihood(measured: np.ndarray, noise: float, errors: np.ndarray | None = None) -> Map:
    """Return the logarithm of the Gaussian likelihood of a measured curve, as a function.

    Args:
        measured: The curve, shape (m,).
        noise: Standard deviation of the noise, independent from point to point.
        errors: By what the true curve exceeds the model's at some parameters, shape (n, m); rows that are not finite
            are left out. `None`: the model has no error.

    Returns:
        A function of predicted curves (n, m); of one that is not finite, its value is minus infinity.

    Raises:
        ValueError: The noise is not above zero, or fewer than two errors are finite.
    """
    if not noise > 0.0:
        raise ValueError(f"noise must lie above 0; received {noise!r}")
    expected, covariance = measured, noise**2 * np.eye(measured.size)
    if errors is not None:
        errors = errors[np.all(np.isfinite(errors), axis=1)]
        if len(errors) < 2:
            raise ValueError(f"errors must be known at two parameters at least; received {len(errors)}")
        expected = measured - errors.mean(axis=0)
        # The mean of n errors is itself uncertain by one n-th of their covariance.
        covariance += (1.0 + 1.0 / len(errors)) * np.cov(errors, rowvar=False)
    density = multivariate_normal(expected, covariance).logpdf
    return lambda curves: np.nan_to_num(np.atleast_1d(density(curves)), nan=-np.inf, neginf=-np.inf)


@dataclass(frozen=True)
class Sample:
    """Parameters with weights.

    Args:
        logarithms: Of the parameters, shape (n, p).
        log_weights: Shape (n,), up to a constant.
    """

    logarithms: np.ndarray
    log_weights: np.ndarray

    def __len__(self) -> int:
        return len(self.logarithms)

    @property
    def weights(self) -> np.ndarray:
        """Weights that sum to one, shape (n,)."""
        return np.exp(self.log_weights - logsumexp(self.log_weights))

    @property
    def effective(self) -> float:
        """How many samples of equal weight are as good, by Kish."""
        return float(1.0 / np.sum(self.weights**2))

    def proposal(self, wider: float = WIDER) -> Any:
        """Student distribution about the mean, its matrix the covariance times the square of `wider`."""
        shape = wider**2 * np.cov(self.logarithms, rowvar=False, aweights=self.weights)
        return multivariate_t(self.weights @ self.logarithms, shape, FREEDOM)

    def summary(self) -> dict[str, np.ndarray]:
        """Mean, standard deviation and ends of the 95 % interval of the parameters, each of shape (p,)."""
        values, weights = np.exp(self.logarithms), self.weights
        mean = weights @ values
        low, high = np.quantile(values, [0.025, 0.975], axis=0, weights=weights, method="inverted_cdf")
        return {"mean": mean, "sd": np.sqrt(weights @ (values - mean) ** 2), "low": low, "high": high}

    def times(self, log_likelihood: np.ndarray) -> Sample:
        """The same parameters, their weights times a likelihood, given by its logarithm, shape (n,)."""
        return Sample(self.logarithms, self.log_weights + log_likelihood)


def draw(bounds: Bounds, count: int, seed: int, proposal: Any = None) -> Sample:
    """Draw samples whose weights make them those of the prior.

    Args:
        bounds: Those of the prior.
        count: How many are drawn; those of a proposal that lie outside of the bounds are left out.
        seed: Of the draw.
        proposal: What they are drawn from, such as `Sample.proposal`; by default the prior itself.

    Returns:
        The samples, as logarithms of the parameters, with their weights.
    """
    low, high = np.log(list(bounds.values())).T
    rng = np.random.default_rng(seed)
    if proposal is None:
        return Sample(rng.uniform(low, high, (count, low.size)), np.zeros(count))
    points = np.atleast_2d(proposal.rvs(count, random_state=rng))
    points = points[np.all((points >= low) & (points <= high), axis=1)]
    return Sample(points, -np.atleast_1d(proposal.logpdf(points)))


def batches(points: np.ndarray, size: int = BATCH) -> list[np.ndarray]:
    """Divide rows into parts of at most `size`."""
    return [points[at : at + size] for at in range(0, len(points), size)]


def search(
    model: Map, likelihood: Map, bounds: Bounds, *, start: Any = None, seed: int = 0, wider: float = WIDER
) -> Any:
    """Find a proposal that resembles the posterior, `wider` times as wide.

    The first stage draws from `start`, by default the prior, each later one from the fit of the one before. A stage
    raises the likelihood to the largest of `POWERS` at which its samples are as good as `LEAST` of equal weight.

    Raises:
        RuntimeError: The power is below 1 after `MOST_STAGES`.
    """
    for stage in range(MOST_STAGES):
        sample = draw(bounds, STAGE, seed + stage, start)
        found = np.concatenate([likelihood(model(part)) for part in batches(sample.logarithms)])
        power = next((one for one in POWERS if sample.times(one * found).effective >= LEAST), POWERS[-1])
        fitted = sample.times(power * found)
        if power == 1.0:
            return fitted.proposal(wider)
        start = fitted.proposal()
    raise RuntimeError(
        f"the search did not reach the posterior in {MOST_STAGES} stages; the likelihood was raised to {power:.2g}"
    )
