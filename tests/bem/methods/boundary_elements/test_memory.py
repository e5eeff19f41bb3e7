import numpy as np
import pytest
from scipy.integrate import quad

from bem.methods.boundary_elements.memory import (
    advance,
    forget_rate,
    new_memory,
    remembered_in,
    shortest_relaxation,
    step_factors,
)
from bem.problem.materials import Elastic, PronySeries, StandardLinearSolid

BROAD = PronySeries([0.3, 0.25, 0.2], [0.02, 1.0, 40.0])


def memory_of(material, size=1):
    return new_memory(np.array(material.strengths), np.array(material.times), size)


def take_step(memory, step, with_earlier, new_traction):
    """March one step with a prescribed traction; what remains of sigma - sum_i c_i q_i."""
    factors = step_factors(memory, step, with_earlier)
    effective = factors.response * new_traction + remembered_in(memory, factors).traction
    advance(memory, factors, step, new_traction)
    return effective


def remember(memory, ago, traction, vectors):
    """Put the states of a known solution `ago` time units back into the memory, newest first."""
    memory.steps[:] = np.diff(ago)
    for k, back in enumerate(ago):
        memory.traction[k, 0] = traction(-back)
        for i, tau in enumerate(memory.times):
            memory.vectors[k, i, 0] = vectors(-back, tau)


def test_linear_traction_is_exact():
    rng = np.random.default_rng(1)
    instants = np.append(0.0, np.cumsum(10.0 ** rng.uniform(-3.0, 2.0, 12)))
    values = np.append(0.0, rng.standard_normal(12))
    memory = memory_of(BROAD)
    for k in range(1, 13):
        effective = take_step(memory, instants[k] - instants[k - 1], False, np.array([values[k]]))
        expected = np.zeros(3)
        for i, tau in enumerate(BROAD.times):
            for a, b, rate in zip(instants[:k], instants[1 : k + 1], np.diff(values) / np.diff(instants), strict=False):
                now, span = instants[k], min(b - a, 60.0 * tau)
                expected[i] += rate * quad(lambda s, n=now, t=tau: np.exp(-(n - s) / t), b - span, b, epsabs=1e-14)[0]
        np.testing.assert_allclose(memory.vectors[0, :, 0], expected, rtol=1e-9, atol=1e-12)
        assert effective[0] == pytest.approx(values[k] - BROAD.strengths @ expected, rel=1e-9, abs=1e-11)


@pytest.mark.parametrize("step", [1e-8, 1e-3, 0.04, 0.06, 0.3])
def test_short_steps_are_exact_for_parabolas(step):
    material = StandardLinearSolid(modulus_ratio=0.1)
    memory = memory_of(material)
    assert step < 4.0 * shortest_relaxation(memory.strengths, memory.times)
    # q' = sigma' - q/tau with sigma = t^2 has the particular solution 2 tau t - 2 tau^2
    remember(memory, [0.0, 1.7 * step, 3.0 * step], lambda t: t * t, lambda t, tau: 2.0 * tau * t - 2.0 * tau**2)
    take_step(memory, step, True, np.array([step**2]))
    assert memory.vectors[0, 0, 0] + 2.0 == pytest.approx(2.0 * step, rel=1e-11, abs=1e-15)


@pytest.mark.parametrize("step", [0.5, 3.0, 200.0])
@pytest.mark.parametrize(("growth", "degree"), [(1.0, 3), (1.4, 3), (2.0, 2)])
def test_long_steps_have_the_claimed_order(step, growth, degree):
    memory = memory_of(StandardLinearSolid(modulus_ratio=0.1))
    solution = {
        2: (lambda t: t**2, lambda t, tau: 2.0 * tau * t - 2.0 * tau**2),
        3: (lambda t: t**3, lambda t, tau: 3.0 * tau * t**2 - 6.0 * tau**2 * t + 6.0 * tau**3),
    }[degree]
    ago = np.array([0.0, step / growth, step / growth + step / growth**2])
    remember(memory, ago, *solution)
    take_step(memory, step, True, np.array([solution[0](step)]))
    assert memory.vectors[0, 0, 0] == pytest.approx(solution[1](step, 1.0), rel=1e-11)


def test_fast_growing_step_drops_a_state():
    memory = memory_of(StandardLinearSolid(modulus_ratio=0.1))
    remember(memory, [0.0, 1.0, 2.0], lambda t: t, lambda _, tau: tau)
    assert np.all(step_factors(memory, 1.4, True).vector[2] != 0.0)
    assert np.all(step_factors(memory, 1.6, True).vector[2] == 0.0)


@pytest.mark.parametrize("growth", [1.0, 1.4])
@pytest.mark.parametrize("relaxations", [0.1, 1.0, 3.9, 4.1, 10.0, 1e2, 1e4])
def test_conforming_surfaces_do_not_ring(relaxations, growth):
    material = StandardLinearSolid(modulus_ratio=1e-3)
    memory = memory_of(material)
    step = relaxations * shortest_relaxation(memory.strengths, memory.times)
    take_step(memory, step, False, np.array([1.0]))
    sizes = []
    for count in range(12 if growth > 1.0 else 60):
        factors = step_factors(memory, step, count > 0)
        balancing = -remembered_in(memory, factors).traction / factors.response  # no displacement from here on
        advance(memory, factors, step, balancing)
        sizes.append(abs(balancing[0]))
        step *= growth
    assert np.all(np.isfinite(sizes))
    assert max(sizes[-4:]) < 0.9 * max(sizes[-8:-4])
    assert max(sizes[-4:]) < 0.5 * sizes[0]


def test_one_term_is_the_sls():
    solid, series = memory_of(StandardLinearSolid(modulus_ratio=0.2)), memory_of(PronySeries([0.8], [1.0]))
    for step, value, earlier in ((0.1, 1.0, False), (0.2, 0.3, True), (3.0, -2.0, True)):
        a = take_step(solid, step, earlier, np.array([value]))
        b = take_step(series, step, earlier, np.array([value]))
        assert a[0] == pytest.approx(b[0], rel=1e-14)


def test_response_lies_between_moduli():
    for material in (StandardLinearSolid(modulus_ratio=1e-3), BROAD):
        memory = memory_of(material)
        responses = [step_factors(memory, step, False).response for step in np.geomspace(1e-9, 1e9, 40)]
        assert np.all(np.diff(responses) > -1e-14)
        assert responses[0] == pytest.approx(material.modulus_ratio, rel=1e-5)
        assert responses[-1] == pytest.approx(1.0, rel=1e-5)


def test_elastic_half_space_has_no_memory():
    memory = memory_of(Elastic(), size=500)
    factors = step_factors(memory, 0.1, True)
    assert memory.vectors.size == memory.traction.size == remembered_in(memory, factors).traction.size == 0
    assert factors.response == 1.0
    assert shortest_relaxation(memory.strengths, memory.times) == np.inf


def test_shortest_time_is_of_displacement():
    memory = memory_of(StandardLinearSolid(modulus_ratio=0.01))
    assert shortest_relaxation(memory.strengths, memory.times) == pytest.approx(0.01)


def test_states_before_a_corner_are_unused():
    memory = memory_of(StandardLinearSolid(modulus_ratio=0.1))
    remember(memory, [0.0, 0.1, 0.2], lambda t: t * t, lambda t, _: t)
    forget_rate(memory)
    factors = step_factors(memory, 0.05, True)
    assert np.all(factors.vector[1:] == 0.0)
    assert np.all(factors.traction[1:] == 0.0)
