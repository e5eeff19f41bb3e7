import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from bem import Scene
from bem.problem import tractions
from bem.problem.tractions import (
    GAP_AT_PEAK,
    LAWS,
    LENNARD_JONES,
    PEAK_TRACTION,
    ConstantStress,
    TractionLaw,
    law_of,
    slope,
    slope_at,
    tail_force,
    tail_force_at,
    traction,
    traction_at,
)
from bem.problem.tractions.law import potential_at, tail_energy_at
from bem.problem.tractions.lennard_jones import potential, tail_energy

OTHERS = (*(law() for law in LAWS.values() if issubclass(law, TractionLaw)), ConstantStress(width=0.05))
GAPS = (0.93, 1.0, 1.01, 1.04, 1.2, 1.5, 1.9, 1.98, 2.05, 3.0)


def test_equilibrium_peak_and_adhesion_work():
    assert traction(1.0) == 0.0
    assert slope(GAP_AT_PEAK) == pytest.approx(0.0, abs=1e-14)
    assert traction(GAP_AT_PEAK) == pytest.approx(PEAK_TRACTION, rel=1e-14)
    assert pytest.approx(1.0264, abs=1e-4) == PEAK_TRACTION
    assert quad(traction, 1.0, np.inf)[0] == pytest.approx(1.0, rel=1e-10)


@given(st.floats(0.05, 50.0))
def test_values_and_slopes_match(gap):
    assert traction(gap) == pytest.approx(8.0 / 3.0 * (gap**-3 - gap**-9), rel=1e-12, abs=1e-13 * gap**-9)
    step = 1e-6 * gap
    numerical = (traction(gap + step) - traction(gap - step)) / (2.0 * step)
    assert slope(gap) == pytest.approx(numerical, rel=1e-6, abs=1e-8 * gap**-10)


@given(st.floats(0.8, 100.0))
def test_force_and_energy_are_integrals(gap):
    attraction, beyond = (quad(of, gap, np.inf, epsabs=0.0, epsrel=1e-11)[0] for of in (traction, potential))
    assert tail_force(gap) == pytest.approx(2.0 * attraction, rel=1e-8, abs=1e-9)
    assert potential(gap) == pytest.approx(-attraction, rel=1e-8, abs=1e-9)
    assert tail_energy(gap) == pytest.approx(2.0 * beyond, rel=1e-8, abs=1e-9)


@pytest.mark.parametrize("gap", GAPS)
def test_default_formulas_are_lennard_jones(gap):
    law = law_of(tractions.LennardJones())
    assert law is LENNARD_JONES
    values = [formula(law, gap) for formula in (traction_at, slope_at, potential_at, tail_force_at, tail_energy_at)]
    assert values == [formula(gap) for formula in (traction, slope, potential, tail_force, tail_energy)]


@pytest.mark.parametrize("adhesion", OTHERS)
def test_laws_share_work_and_peak_traction(adhesion):
    law = law_of(adhesion)
    assert traction_at(law, 1.0) == pytest.approx(0.0, abs=1e-12)
    places = np.linspace(1.0, 3.0, 4001)
    assert max(traction_at(law, gap) for gap in places) == pytest.approx(PEAK_TRACTION, rel=1e-5)
    assert traction_at(law, adhesion.peak_gap) == pytest.approx(PEAK_TRACTION, rel=1e-5)
    ends = [1.0, *adhesion.breaks]
    work = sum(quad(lambda h: traction_at(law, h), a, b)[0] for a, b in itertools.pairwise(ends))
    assert work == pytest.approx(1.0, abs=1e-8)
    assert potential_at(law, 1.0) == pytest.approx(-1.0, abs=1e-8)
    joint = adhesion.breaks[0]  # where the law joins its repulsion
    assert tail_energy_at(law, joint - 1e-9) == pytest.approx(tail_energy_at(law, joint + 1e-9), abs=1e-7)
    beyond = adhesion.breaks[-1] + 1e-9
    assert traction_at(law, beyond) == tail_force_at(law, beyond) == tail_energy_at(law, beyond) == 0.0


@pytest.mark.parametrize("adhesion", OTHERS)
@pytest.mark.parametrize("gap", GAPS)
def test_formulas_are_derivatives(adhesion, gap):
    law, step = law_of(adhesion), 1e-6

    def change(formula):
        return (formula(law, gap + step) - formula(law, gap - step)) / (2.0 * step)

    assert slope_at(law, gap) == pytest.approx(change(traction_at), rel=2e-5, abs=1e-5)
    assert traction_at(law, gap) == pytest.approx(change(potential_at), rel=1e-6, abs=1e-8)
    assert potential_at(law, gap) == pytest.approx(-0.5 * change(tail_energy_at), rel=1e-6, abs=1e-8)
    assert tail_force_at(law, gap) == -2.0 * potential_at(law, gap)


def test_constant_stress_is_constant():
    narrow = ConstantStress(width=0.05)
    law = law_of(narrow)
    plateau = np.linspace(narrow.peak_gap, narrow.range - 0.025, 50)
    assert [traction_at(law, gap) for gap in plateau] == pytest.approx([PEAK_TRACTION] * 50, rel=1e-12)
    assert narrow.range == pytest.approx(1.0 + 1.0 / PEAK_TRACTION, abs=0.01)  # Dugdale's, without a rise
    assert traction_at(law, narrow.range) == pytest.approx(0.5 * PEAK_TRACTION)


STEEPNESS = 2.0 * PEAK_TRACTION


class Morse(TractionLaw):
    breaks = (1.0, 1.0 + 8.0 / STEEPNESS, 1.0 + 40.0 / STEEPNESS)
    peak_gap = 1.0 + np.log(2.0) / STEEPNESS
    repulsion = (STEEPNESS**2 / 8.0, 1.0)

    def traction(self, gap):
        decay = np.exp(-STEEPNESS * (gap - 1.0))
        return 2.0 * STEEPNESS * decay * (1.0 - decay)

    def slope(self, gap):
        decay = np.exp(-STEEPNESS * (gap - 1.0))
        return 2.0 * STEEPNESS**2 * decay * (2.0 * decay - 1.0)


def morse(**changes):
    return type("Wrong", (Morse,), changes)()


def altered(name, change):
    return {name: lambda self, gap: change(getattr(Morse, name)(self, gap))}


class Silent(TractionLaw):
    breaks, traction, slope = Morse.breaks, Morse.traction, Morse.slope


class WithoutRepulsion(Silent):
    peak_gap = Morse.peak_gap


PLATEAU = ConstantStress()
LATE = type("Late", (ConstantStress,), {"peak_gap": 1.5, "breaks": PLATEAU.breaks, "range": PLATEAU.range})()


def test_users_law_is_part_of_a_scene():
    assert Scene(tabor=1.0, adhesion=morse()).adhesion.peak_gap == Morse.peak_gap


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (Silent(), "a traction law must state its repulsion"),
        (WithoutRepulsion(), "a traction law must state its repulsion"),
        (morse(repulsion=(1.0, -1.0)), "repulsion of a traction law must be two numbers above zero"),
        (morse(repulsion="steep"), "repulsion of a traction law must be"),
        (morse(peak_gap=np.nan), "peak_gap of a traction law must be a finite number"),
        (morse(fineness=0.0), "fineness of a traction law must be"),
        (morse(breaks=(2.0, 1.5)), "breaks of a traction law must be at least two rising gaps"),
        (morse(breaks=(0.9, 2.0)), "breaks of a traction law must be at least two rising gaps"),
        (morse(breaks=(1.0, np.inf)), "breaks of a traction law must be"),
        (morse(peak_gap=1.5), r"peak_gap of a traction law must be the smallest gap of its largest traction, 1\.3"),
        (LATE, "peak_gap of a traction law must be the smallest gap"),
        (
            morse(**altered("traction", lambda error: np.where(error < 0.1, np.nan, error))),
            "traction of a traction law must be finite",
        ),
        (morse(**altered("slope", lambda error: error * np.nan)), "slope of a traction law must be finite"),
        (morse(**altered("traction", lambda _: 1.0)), "traction of a traction law must be as many numbers"),
        (morse(**altered("slope", lambda _: None)), "slope of a traction law must be"),
        (morse(**altered("slope", lambda error: 1.01 * error)), "slope .* must be continuous and the derivative"),
        (morse(**altered("slope", lambda error: -error)), "slope .* must be continuous and the derivative"),
        (morse(**altered("traction", lambda error: np.where(error < 0.1, 0.0, error))), "slope .* must be continuous"),
        (morse(breaks=(1.2, *Morse.breaks[1:])), "slope .* must be continuous"),
        (morse(breaks=(1.0, 2.0)), "slope .* must be continuous"),
        (morse(**altered("traction", lambda error: error + 1e-3)), "traction of a law must end at zero"),
        (
            morse(
                repulsion=(2.0 * Morse.repulsion[0], 1.0),
                **altered("traction", lambda error: 2.0 * error),
                **altered("slope", lambda error: 2.0 * error),
            ),
            "the work of adhesion of a traction law must be 1",
        ),
    ],
)
def test_wrong_law_is_refused_by_the_scene(law, message):
    with pytest.raises(ValueError, match=f"^{message}.*; received") as error:
        Scene(tabor=1.0, adhesion=law)
    assert "\n" not in str(error.value)


def test_a_law_of_ones_own_is_one_class():
    """Inverse powers: Lennard-Jones itself, as numbers from its largest traction outwards."""

    class Numbers(TractionLaw):
        breaks = (GAP_AT_PEAK, 1.5, 2.5, 5.0, 12.0, 40.0, 200.0, 2000.0)
        peak_gap = GAP_AT_PEAK
        repulsion = (1.0, 1.0)

        def traction(self, gap):
            return 8.0 / 3.0 * (gap**-3.0 - gap**-9.0)

        def slope(self, gap):
            return 8.0 * (3.0 * gap**-10.0 - gap**-4.0)

    law = law_of(Numbers())
    for gap in (0.8, 1.1, *GAPS, 15.0, 90.0):
        assert traction_at(law, gap) == pytest.approx(traction(gap), rel=1e-6, abs=1e-12)
        assert slope_at(law, gap) == pytest.approx(slope(gap), rel=1e-4, abs=1e-12)
        assert potential_at(law, gap) == pytest.approx(potential(gap), rel=1e-2, abs=1e-6)  # it ends at 2000
