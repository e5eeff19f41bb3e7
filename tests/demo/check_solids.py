"""The pretrained models of the page in headless Chromium against Python; run by `make test-demo`."""

import json

import numpy as np
import pytest

import surrogate
from bem.lab import Setup
from surrogate.data.metrics import nmae
from tests.demo.check_in_browser import TILES, TOLERANCE, column, python, table

CASES = ("usual", "elastic", "fast", "slow", "brief", "outside")
MODELS = ("fast", "accurate")


@pytest.fixture(scope="module")
def seen(browsed):
    return browsed["solids"]


@pytest.fixture(scope="module")
def solid_curves(folder):
    path = folder / "root" / "some" / "sub-path" / "solids.json"
    return json.loads(path.read_text(encoding="utf-8"))["curves"]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("case", CASES)
def test_numbers_are_those_of_python(seen, folder, model, case):
    shown = seen["cases"][f"{model}-{case}"]
    (expected,) = python(surrogate.load(model), [shown["protocol"]])
    assert shown["model"] == {"link": model, "chosen": model, "named": model}
    # Forces are of a network in single precision.
    scale = 1e-5 * np.abs(expected.force).max()
    # An elastic loop loses almost nothing: what is left of large areas is known as well as they are.
    rounding = {"hysteresis": 2.0 * scale * np.ptp(expected.indentation)}
    for tile, name in TILES.items():
        value = pytest.approx(getattr(expected, name), rel=TOLERANCE, abs=rounding.get(name, 0.0))
        assert shown["values"][tile] == value
    rows = table(folder / f"{model}-{case}.csv")
    # Times and indentations in double precision.
    np.testing.assert_allclose(column(rows, "time"), expected.time, rtol=1e-11)
    np.testing.assert_allclose(column(rows, "indentation"), expected.indentation, rtol=1e-11, atol=1e-10)
    np.testing.assert_allclose(column(rows, "modulus_ratio"), expected.modulus_ratio, rtol=1e-7)
    np.testing.assert_allclose(column(rows, "force"), expected.force, rtol=TOLERANCE, atol=scale)
    if expected.extrapolated:
        assert {(row["force_lower"], row["force_upper"]) for row in rows} == {("", "")}
        return
    for name in ("force_lower", "force_upper"):
        np.testing.assert_allclose(column(rows, name), getattr(expected, name), rtol=TOLERANCE, atol=scale)
    low, high, text = shown["interval"]
    np.testing.assert_allclose([float(low), float(high)], expected.pull_off_interval, rtol=TOLERANCE)
    assert text.startswith("90 %: ")


@pytest.mark.parametrize("model", MODELS)
def test_errors_of_curves_equal_python(seen, solid_curves, model):
    expected = python(surrogate.load(model), [curve["protocol"] for curve in solid_curves])
    names, errors, pull_offs = zip(*seen["lists"][model], strict=True)
    assert list(names) == [curve["name"] for curve in solid_curves]
    true = np.array([curve["force"] for curve in solid_curves])
    np.testing.assert_allclose(errors, nmae(np.array([trajectory.force for trajectory in expected]), true), rtol=2e-3)
    peaks = np.array([curve["results"]["pull_off_force"] for curve in solid_curves])
    ours = 100.0 * np.abs(np.array([trajectory.pull_off_force for trajectory in expected]) / peaks - 1.0)
    np.testing.assert_allclose(pull_offs, ours, atol=100 * TOLERANCE)


def test_single_modulus_ratio_is_fixed(seen):
    assert seen["before"]["fixed"] == seen["back"]["fixed"] == [["modulus_ratio", "0.1"]]
    assert seen["before"]["interval"] is seen["back"]["interval"] is None
    assert "modulus_ratio" not in seen["back"]["protocol"]
    assert seen["back"]["model"]["link"] is None
    assert seen["keyed"]["fixed"] == []
    assert float(seen["keyed"]["protocol"]["modulus_ratio"]) > 0.1
    # It comes back with the model.
    assert seen["again"]["protocol"] == seen["keyed"]["protocol"]


def test_last_of_models_chosen_fast_stays(seen):
    assert seen["hurried"]["model"] == {"link": "accurate", "chosen": "accurate", "named": "accurate"}
    assert seen["hurried"]["interval"] is not None


def test_interval_says_outside_training(seen):
    outside = seen["outside"]
    assert outside["interval"] == ["-Infinity", "Infinity", "90 %: unbounded, outside the training"]
    assert outside["extrapolation"].endswith(
        "outside its training range in Modulus ratio; there its 90 % band and interval are unbounded."
    )
    assert seen["refused"] == "Give a number from 0.00001 to 1."


def test_solver_curve_has_a_residual(seen, folder, solid_curves):
    shown = seen["solid"]
    assert shown["picked"] == "solid-3"
    curve = next(candidate for candidate in solid_curves if candidate["name"] == "solid-3")
    assert float(shown["protocol"]["modulus_ratio"]) == pytest.approx(curve["protocol"]["modulus_ratio"], rel=1e-7)
    rows = table(folder / "solid.csv")
    assert [float(row["solver_force"]) for row in rows] == curve["force"]
    true, force, lower, upper = (column(rows, name) for name in ("solver_force", "force", "force_lower", "force_upper"))
    largest = float(shown["residual"].removesuffix(" in size.").split(" at most ")[1])
    assert largest == pytest.approx(np.abs(force - true).max(), rel=1e-3)
    inside = int(((lower <= true) & (true <= upper)).sum())
    assert f"its force inside the band at {inside} of {len(rows)} steps." in shown["comparison"]
    low, high, _ = shown["interval"]
    word = "inside" if float(low) <= curve["results"]["pull_off_force"] <= float(high) else "outside"
    assert f"lies {word} the 90 % interval" in shown["comparison"]
    assert seen["outside"]["residual"] is None
    assert (folder / "solid-charts.png").stat().st_size > 20_000
    assert seen["pngName"].endswith("_accurate.png")


def test_laboratory_units_reach_the_band(seen, folder):
    shown = seen["laboratory"]
    tabor = float(shown["protocol"]["tabor"])
    setup = Setup(
        radius=20e-9,
        work_of_adhesion=0.05,
        relaxed_modulus=1e9,
        poisson_ratio=0.0,
        retardation_time=0.01,
        largest_tabor=tabor,
    )
    rows = table(folder / "solid-laboratory.csv")
    np.testing.assert_allclose(column(rows, "force_N"), setup.force_scale * column(rows, "force"), rtol=1e-12)
    low, _, text = shown["interval"]
    assert low == seen["solid"]["interval"][0]
    number, unit = text.removeprefix("90 %: ").split(" to ")[0].split("\xa0")
    prefix = {"nN": 1e-9, "µN": 1e-6, "pN": 1e-12}[unit]
    assert float(number) * prefix == pytest.approx(setup.force_scale * float(low), rel=1e-4)


def test_a_link_opens_the_same_on_a_phone(seen):
    for key in ("protocol", "model", "picked"):
        assert seen["linked"][key] == seen["laboratory"][key], key
    # A link has eight digits.
    low, high = (float(end) for end in seen["laboratory"]["interval"][:2])
    residuals = [float(seen[state]["residual"].split(" at most ")[1].split()[0]) for state in ("linked", "laboratory")]
    assert residuals[0] == pytest.approx(residuals[1], abs=1e-5 * high)
    assert [float(end) for end in seen["linked"]["interval"][:2]] == pytest.approx([low, high], rel=1e-5)
    assert seen["linked"]["wide"] is False
    assert min(seen["visible"].values()) > 0.95


@pytest.mark.parametrize(
    ("trouble", "sentence"),
    [
        ("missing", "The model could not be loaded (./fast.onnx answers 404)."),
        ("foreign", "./fast.onnx is not a surrogate of this project: its metadata do not say so."),
        ("curves", "The solver curves could not be read: ./solids.json is not what experiments.demo_curves writes."),
    ],
)
def test_unavailable_model_keeps_the_former(seen, trouble, sentence):
    message = seen["failing"][trouble]
    assert message["said"] == f"{sentence} The model before stays."
    assert message["kept"] == "model-paper"
