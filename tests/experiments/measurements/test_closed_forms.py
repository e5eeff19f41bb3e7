"""Closed forms as tools: where they are asked, and how close they come there."""

import numpy as np
import pytest

from bem import LoadingProtocol, Scene, StandardLinearSolid
from experiments.measurements import cases, closed_forms
from experiments.measurements.statistics import force_error


def made_case(tabor, depth, rate, dwell=0.1):
    ramps = {"peak_indentation": depth, "loading_rate": rate, "dwell_time": dwell, "unloading_rate": rate}
    return cases.Case(Scene(tabor, StandardLinearSolid(0.1)), LoadingProtocol(**ramps))


@pytest.mark.parametrize(
    ("case", "inside"),
    [
        (made_case(1.0, 80.0, 0.1), {"Hertz, rubbery", "Lee and Radok, until the peak", "Maugis-Dugdale, rubbery"}),
        (made_case(1.0, 80.0, 1e4, 1e-3), {"Hertz, glassy", "Lee and Radok, until the peak"}),
        (made_case(3.0, 2.0, 0.1), {"JKR, rubbery", "Maugis-Dugdale, rubbery", "Persson-Brener, pull-off"}),
        (made_case(0.2, 2.0, 0.1), {"DMT, rubbery", "Maugis-Dugdale, rubbery"}),
        (made_case(1.0, 2.0, 5.0), set()),
        (made_case(1.0, 2.0, 1.0), set()),  # ramps of four retardation times are not slow
    ],
)
def test_closed_forms_are_asked_in_their_regime_only(case, inside):
    assert {form.name for form in closed_forms.FORMS if form.meant_for(case)} >= inside
    if not inside:
        assert not any(form.meant_for(case) for form in closed_forms.FORMS)


def test_a_fast_unloading_is_not_slow():
    ramps = {"peak_indentation": 2.0, "loading_rate": 0.1, "dwell_time": 0.1, "unloading_rate": 1e3}
    assert not closed_forms.slow(cases.Case(Scene(1.0, StandardLinearSolid(0.1)), LoadingProtocol(**ramps)))


def test_closed_forms_are_close_to_the_solver_where_they_are_exact():
    forms = {form.name: form for form in closed_forms.FORMS}
    slow, fast, short = made_case(1.0, 80.0, 0.1), made_case(1.0, 80.0, 1e4, 1e-3), made_case(3.0, 20.0, 1.0, 3.0)
    for name, case in (("Hertz, rubbery", slow), ("Hertz, glassy", fast), ("Lee and Radok, until the peak", fast)):
        force = forms[name].answer(case)[2:]
        exact = case.on_steps(case.run("draft"))["force"]
        assert force_error(force[None], exact[None])[0] < 0.05
        assert np.isnan(force[closed_forms.FIRST_UNLOADING + 1 :]).all() == name.startswith("Lee")
    pull_off, _, *force = forms["Persson-Brener, pull-off"].answer(short)
    assert pull_off == pytest.approx(short.run("standard").pull_off_force, rel=0.1)
    assert np.isnan(force).all()
