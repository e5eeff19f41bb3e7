"""The posterior of a line, whose parameters are logarithms, is known in closed form."""

import numpy as np
import pytest

from surrogate.posterior import WIDER, Sample, batches, draw, likelihood, search

TIMES = np.linspace(0.0, 1.0, 40)
NOISE = 0.1
PRIOR = {"offset": (0.1, 10.0), "slope": (0.1, 10.0)}
DESIGN = np.column_stack([np.ones_like(TIMES), TIMES])
TRUE = np.log([1.5, 0.7])


def line(logarithms):
    """A model that is linear in the logarithms, so that the posterior inside the bounds is Gaussian."""
    return logarithms @ DESIGN.T


def measured(seed=0):
    return line(TRUE) + NOISE * np.random.default_rng(seed).standard_normal(TIMES.size)


def exact(curve, covariance):
    """Mean and covariance of the least-squares solution."""
    weighted = np.linalg.solve(covariance, DESIGN)
    spread = np.linalg.inv(DESIGN.T @ weighted)
    return spread @ weighted.T @ curve, spread


def sampled(judge, model=line):
    sample = draw(PRIOR, 40_000, 50, search(model, judge, PRIOR))
    return sample.times(judge(model(sample.logarithms)))


def compare(sample, mean, covariance):
    weights, deviations = sample.weights, np.sqrt(np.diag(covariance))
    assert sample.effective > 0.5 * len(sample)
    np.testing.assert_allclose(weights @ sample.logarithms, mean, rtol=0.0, atol=0.03 * deviations.min())
    found = np.cov(sample.logarithms, rowvar=False, aweights=weights)
    np.testing.assert_allclose(found, covariance, rtol=0.05, atol=0.03 * covariance.max())


def test_weighted_samples_are_those_of_the_exact_posterior():
    curve = measured()
    compare(sampled(likelihood(curve, NOISE)), *exact(curve, NOISE**2 * np.eye(TIMES.size)))


def test_a_models_error_shifts_and_widens_the_posterior_as_its_mean_and_covariance_say():
    rng, curve = np.random.default_rng(3), measured()
    errors = 0.3 + 0.2 * rng.standard_normal((400, 1)) * TIMES
    # A curve that the model misses by such an error.
    found = sampled(likelihood(curve + 0.3, NOISE, errors))
    covariance = NOISE**2 * np.eye(TIMES.size) + (1.0 + 1.0 / 400) * np.cov(errors, rowvar=False)
    mean, spread = exact(curve + 0.3 - errors.mean(axis=0), covariance)
    compare(found, mean, spread)
    assert spread[1, 1] > 1.5 * exact(curve, NOISE**2 * np.eye(TIMES.size))[1][1, 1]


def test_summaries_are_those_of_the_parameters_and_not_of_their_logarithms():
    sample = Sample(np.log([[1.0], [2.0], [4.0], [100.0]]), np.array([0.0, 0.0, 0.0, -np.inf]))
    found = sample.summary()
    assert found["mean"] == pytest.approx(7.0 / 3.0)
    assert (found["low"], found["high"]) == (pytest.approx(1.0), pytest.approx(4.0))
    assert found["sd"] == pytest.approx(np.std([1.0, 2.0, 4.0]))
    assert sample.effective == pytest.approx(3.0)


def test_samples_of_a_proposal_are_weighted_to_be_the_priors():
    proposal = Sample(np.random.default_rng(1).normal(0.0, 1.5, (500, 2)), np.zeros(500)).proposal()
    sample = draw(PRIOR, 60_000, 2, proposal)
    low, high = np.log([0.1, 10.0])
    assert sample.logarithms.min() >= low
    assert sample.logarithms.max() <= high
    assert len(sample) < 60_000
    np.testing.assert_allclose(sample.weights @ sample.logarithms, 0.0, atol=0.05)
    np.testing.assert_allclose(sample.weights @ sample.logarithms**2, (high - low) ** 2 / 12.0, rtol=0.03)
    narrow, wide = (search(line, likelihood(measured(), NOISE), PRIOR, wider=wider) for wider in (WIDER, 2.0 * WIDER))
    np.testing.assert_allclose(wide.shape, 4.0 * narrow.shape)


def test_curves_that_are_not_known_have_no_weight():
    judge = likelihood(measured(), NOISE)
    curves = line(np.array([TRUE, TRUE]))
    curves[1, 3] = np.nan
    found = judge(curves)
    assert np.isfinite(found[0])
    assert found[1] == -np.inf

    def failing(logarithms):
        """A model that does not know a curve in eight."""
        curves = line(logarithms)
        curves[::8] = np.nan
        return curves

    sample = sampled(judge, failing)
    mean, covariance = exact(measured(), NOISE**2 * np.eye(TIMES.size))
    np.testing.assert_allclose(
        sample.weights @ sample.logarithms, mean, rtol=0.0, atol=0.03 * np.sqrt(covariance[0, 0])
    )


def test_what_cannot_be_is_said():
    with pytest.raises(ValueError, match=r"noise must lie above 0; received 0\.0"):
        likelihood(measured(), 0.0)
    with pytest.raises(ValueError, match="at two parameters at least; received 1"):
        likelihood(measured(), NOISE, np.array([np.full(40, np.nan), np.zeros(40)]))
    curve = np.full(TIMES.size, 5.0)

    def unrelated(logarithms):
        return np.random.default_rng(0).normal(0.0, 30.0, (len(logarithms), TIMES.size))

    with pytest.raises(RuntimeError, match="did not reach the posterior in 20 stages"):
        search(unrelated, likelihood(curve, 1e-3), PRIOR)


def test_batches_hold_every_row_once():
    parts = batches(np.arange(10.0)[:, np.newaxis], 4)
    assert [len(part) for part in parts] == [4, 4, 2]
    np.testing.assert_array_equal(np.concatenate(parts)[:, 0], np.arange(10.0))
