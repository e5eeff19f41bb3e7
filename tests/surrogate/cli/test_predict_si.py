"""`surrogate predict` with a material, and in newtons."""

import json

import numpy as np
import pytest

import surrogate
from bem import LoadingProtocol, PronySeries, Scene, simulate
from bem.lab import Setup
from bem.lab.setup import EFFECTIVE_TABOR, EffectiveRangeWarning
from bem.materials_library import load

CYCLE = {
    "peak_indentation": "60nm",
    "loading_rate": "1um/s",
    "unloading_rate": "1um/s",
    "dwell_time": "10ms",
}
CONTACT = {"radius": "5um", "work_of_adhesion": "50mJ/m2"}


def words(cycle):
    """A contact and its cycle as options."""
    return [word for name, value in (CONTACT | cycle).items() for word in (f"--{name.replace('_', '-')}", value)]


LABORATORY = words(CYCLE)


def test_material_of_the_library_in_newtons(program):
    code, out, _ = program("predict", "fast", "--material", "polyurea", *LABORATORY, "--json")
    assert code == 0
    found = json.loads(out)
    entry = load("polyurea_at_0c")
    setup = Setup(
        **CONTACT, largest_tabor=EFFECTIVE_TABOR, relaxed_modulus=entry.relaxed_modulus, material=entry.material
    )
    with pytest.warns(EffectiveRangeWarning):
        exact = setup.simulate(setup.protocol(**CYCLE), 1e-3)
    assert found["pull_off_force"] == pytest.approx(exact.pull_off_force, rel=0.02)
    assert found["tabor"] == pytest.approx(setup.physical_tabor)
    low, high = found["pull_off_interval"]
    assert low < found["pull_off_force"] < high
    code, out, _ = program("predict", "fast", "--material", "polyurea", *LABORATORY)
    assert code == 0
    assert "90 % interval" in out


def test_elastic_material_needs_no_time(program):
    soft = CYCLE | {"peak_indentation": "300nm"}
    # The first call may say that it compiles.
    slower = words(soft | {"dwell_time": "1000s"})
    again = program("predict", "fast", "--material", "sylgard_184", *slower, "--json")[1]
    code, out, err = program("predict", "fast", "--material", "sylgard_184", *words(soft), "--json")
    assert (code, err) == (0, "")
    entry = load("sylgard_184_cured_at_100c")
    setup = Setup(**CONTACT, largest_tabor=EFFECTIVE_TABOR, relaxed_modulus=entry.relaxed_modulus)
    exact = setup.simulate(setup.protocol(**soft), 1e-3)
    assert json.loads(out)["pull_off_force"] == pytest.approx(exact.pull_off_force, rel=0.01)
    assert json.loads(again)["pull_off_force"] == json.loads(out)["pull_off_force"]


def test_prony_series_of_the_command_line(program):
    words = ["--material", "prony:0.3@0.1,0.4@10", "--tabor", 1, "--peak-indentation", 20, "--loading-rate", 10]
    words += ["--dwell-time", 1, "--unloading-rate", 10]
    code, out, err = program("predict", "fast", *words, "--check", "--json")
    assert (code, err) == (0, "")
    (found,) = json.loads(out)
    scene = Scene(1.0, PronySeries([0.3, 0.4], [0.1, 10.0]))
    protocol = LoadingProtocol(peak_indentation=20.0, loading_rate=10.0, dwell_time=1.0, unloading_rate=10.0)
    exact = simulate(scene, protocol, 1e-3)
    assert found["pull_off_force"] == pytest.approx(exact.pull_off_force, rel=0.01)
    assert found["hysteresis"] == pytest.approx(exact.hysteresis, rel=0.03)
    predicted = surrogate.load("fast").predict(scene, protocol)
    np.testing.assert_allclose(found["force"], predicted.force)
    assert found["check"]["force_rms"] < 0.01


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ("predict", "M1-concat", "--material", "polyurea"),
            "--material must go with fast or accurate, which know any solid",
        ),
        (
            ("predict", "fast", "--material", "elastic", "--modulus-ratio", 0.1),
            "the solid must come from --material or from modulus ratios, not both",
        ),
        (("predict", "fast", "--material", "pvb", *LABORATORY), "fast, `bem.simulate` takes others"),
    ],
)
def test_what_does_not_go_together_is_refused(program, words, message):
    code, out, err = program(*words)
    assert (code, out) == (2, "")
    assert message in err
