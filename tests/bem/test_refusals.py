"""What the words of a user refuse: one sentence with the quantity, what is allowed and what was received."""

import numpy as np
import pytest

from bem import (
    ConstantStress,
    Elastic,
    ForceProtocol,
    HardContact,
    LoadingProtocol,
    PiecewiseLinearProtocol,
    PronySeries,
    Scene,
    StandardLinearSolid,
    TractionLaw,
    simulate,
    simulate_paper_method,
)
from bem.accuracy import resolve_accuracy

CYCLE = {"peak_indentation": 10.0, "loading_rate": 2.0, "dwell_time": 0.5, "unloading_rate": 4.0}
SCENE, PROTOCOL = Scene(1.0, StandardLinearSolid(0.1)), LoadingProtocol(**CYCLE)
PAIRS = [0.0, 1.0], [0.0, 1.0]
SPEED = r"must be a finite number at least 1e-12 and at most 1e\+12; received"


def scene(**changes):
    return Scene(**{"tabor": 1.0} | changes)


def cycle(**changes):
    return LoadingProtocol(**CYCLE | changes)


def simulated(**changes):
    return simulate(**{"scene": SCENE, "protocol": PROTOCOL, "accuracy": "draft"} | changes)


def by_the_paper(**changes):
    return simulate_paper_method(**{"scene": SCENE, "protocol": PROTOCOL} | changes)


def each(call, name, message, *values):
    return [(call, {name: value}, message) for value in values]


REFUSED = [
    *each(
        scene, "tabor", "tabor must be a finite number at least 1e-06 and at most 10000", 0, np.nan, np.inf, 1e5, "3"
    ),
    *each(scene, "material", r"material must be one of Elastic\(\.\.\.\), ", "rubber", None, Elastic, HardContact()),
    *each(scene, "adhesion", "adhesion must be one of LennardJones", Elastic(), "none", ConstantStress, TractionLaw),
    *each(scene, "spring", r"spring must be .* at least 1e-06 and at most 1e\+12", 0.0, np.nan, -np.inf, 1e13, True),
    *each(
        StandardLinearSolid, "modulus_ratio", "modulus_ratio must be .* greater than 0 and at most 1", 0, 1.1, "soft"
    ),
    *each(
        ConstantStress, "width", r"width must be a finite number at least 0\.05 and at most 1", 0.01, 2.0, "wide", True
    ),
    *each(cycle, "loading_rate", f"loading_rate {SPEED}", 0.0, -1.0, np.nan, np.inf, 1e13, "fast"),
    *each(cycle, "unloading_rate", f"unloading_rate {SPEED}", 0.0, 1e13),
    *each(cycle, "dwell_time", "dwell_time must be a finite number at least 0", -1e-9),
    *each(cycle, "peak_indentation", "peak_indentation must be a finite number", np.nan),
    *each(cycle, "start_indentation", r"start_indentation must be .* less than 10; received 10\.0", 10.0),
    *each(simulated, "scene", r"^scene must be one of Scene\(\.\.\.\); received 'a sphere'$", "a sphere"),
    *each(simulated, "protocol", r"^protocol must be one of LoadingProtocol\(\.\.\.\), Piece.*; received 3\.0$", 3.0),
    *each(simulated, "accuracy", r"^accuracy must be 'draft', .*; received 'perfect'$", "perfect"),
    *each(simulated, "initial_state", r"^initial_state must be 'relaxed' or 'glassy'; received 'wet'$", "wet"),
    *each(simulated, "mesh", r"^mesh must start at 0 and increase strictly; received", [0.0, 2.0, 1.0]),
    *each(simulated, "mesh", r"^mesh must be a 1D array of at least 3 finite radii", [0.0, 2.0]),
    *each(by_the_paper, "nodes", "nodes must be a whole number from 10 to 4000", 5),
    *each(by_the_paper, "steps", "steps must be a whole number from 2 to 20000", 1),
    *each(by_the_paper, "scene", "adhesion of the scene must be one of LennardJones", scene(adhesion=HardContact())),
    *each(by_the_paper, "scene", "the paper's method knows no spring", scene(spring=1.0)),
    *each(by_the_paper, "protocol", "protocol must be one of", None),
]


@pytest.mark.parametrize(("call", "changes", "message"), REFUSED)
def test_a_wrong_quantity_is_named(call, changes, message):
    with pytest.raises(ValueError, match=message) as found:
        call(**changes)
    assert "received" in str(found.value)
    assert "\n" not in str(found.value)


@pytest.mark.parametrize("kind", [PiecewiseLinearProtocol, ForceProtocol])
@pytest.mark.parametrize(
    ("times", "values", "message"),
    [
        ([0.0, 0.0], [0.0, 1.0], "times must be strictly increasing"),
        ([0.0, 1.0, 0.5], [0.0, 1.0, 2.0], r"received 1\.0 followed by 0\.5"),
        ([0.0], [0.0], "times must be a one-dimensional sequence of at least 2"),
        ([-np.inf, 0.0], [0.0, 1.0], "times must be"),
        ([0.0, 1.0], [0.0, np.nan], "s must be a one-dimensional sequence"),
        ([0.0, 1.0], ["0", "1"], "s must be"),
        ([0.0, 1.0], [0.0, 1.0, 2.0], "times and .*s must have the same length; received 2 and 3"),
        (np.arange(100_001), np.zeros(100_001), "times must be at most 100000 instants, .*; received 100001"),
        ([0.0, 1.0], [0.0, 1e10], r"s must lie within \+-1e\+0"),
    ],
)
def test_what_is_no_history_is_named(kind, times, values, message):
    with pytest.raises(ValueError, match=message):
        kind(times, values)


@pytest.mark.parametrize("make", [PronySeries, PronySeries.from_moduli])
@pytest.mark.parametrize(
    ("amounts", "times", "message"),
    [
        ([-0.1], [1.0], "(compliances|moduli) must be at least 0"),
        ([0.1], [0.0], "times must be greater than 0"),
        ([0.1], [np.inf], "times must be a one-dimensional"),
        ([0.1, 0.1], [1.0, 1.0], "distinct"),
        ([0.1, 0.1], [1.0], "same length"),
    ],
)
def test_what_is_no_spectrum_is_named(make, amounts, times, message):
    with pytest.raises(ValueError, match=message):
        make(amounts, times)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: PronySeries([0.5, 0.5], [1.0, 2.0]), "sum less than 1"),
        (lambda: PiecewiseLinearProtocol(*PAIRS, ("loading", "dwell")), "phases must name each of the 1 segments"),
        (lambda: cycle(dwell_time=1e-300).history(1.0), "the dwell phase must outlast the rounding of its start time"),
    ],
)
def test_what_cannot_be_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize(
    "accuracy", ["best", "", "1e-3", None, True, 0.0, -1e-3, np.nan, np.inf, 0.06, 1e-5, [1e-3], 1e-3 + 0j]
)
def test_an_unknown_accuracy_is_refused_with_what_is_allowed(accuracy):
    with pytest.raises(ValueError, match=r"^accuracy must be 'draft', 'standard', 'reference' or .*; received"):
        resolve_accuracy(accuracy)


def test_the_quantities_of_a_cycle_are_given_by_name():
    with pytest.raises(TypeError):
        LoadingProtocol(10.0, 2.0, 0.5, 4.0)
