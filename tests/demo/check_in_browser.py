"""The demonstrator in headless Chromium against Python; run by `make test-demo`, which builds the page first."""

import csv
import json

import numpy as np
import pytest

from bem.designs import QUANTITIES
from bem.measurement import FMS, measurement_grid
from surrogate.features import edge_from_counts
from surrogate.metrics import hysteresis, nmae, pull_off

TOLERANCE = 1e-4


def predicted(session, protocols):
    columns = {name: np.array([float(protocol[name]) for protocol in protocols]) for name in QUANTITIES}
    times, indentations = measurement_grid(**columns)
    edge = edge_from_counts(FMS, len(times))
    inputs = {"times": times, "indentations": indentations, "tabor": columns["tabor"], "edge": edge}
    return times, indentations, session.run(["force"], inputs)[0]


def numbers(session, protocol):
    times, indentations, force = predicted(session, [protocol])
    peak_force, peak_time = pull_off(times, force, FMS[0] + FMS[1] - 1)
    return {
        "pull-off-force": peak_force[0],
        "pull-off-time": peak_time[0],
        "hysteresis": hysteresis(indentations, force)[0],
    }


def table(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("moment", ["start", "dragged", "typed", "shared", "preset", "outside", "phone"])
def test_numbers_are_those_of_python(browsed, session, moment):
    seen = browsed[moment]
    for name, expected in numbers(session, seen["protocol"]).items():
        assert seen["values"][name] == pytest.approx(expected, rel=TOLERANCE)
        assert float(seen["shown"][name].replace("−", "-")) == pytest.approx(expected, rel=TOLERANCE)


def test_dragging_moves_what_it_should(browsed):
    start, dragged = (browsed[moment]["protocol"] for moment in ("start", "dragged"))
    assert {name for name in QUANTITIES if start[name] != dragged[name]} == {"tabor", "loading_rate", "dwell_time"}
    assert float(dragged["tabor"]) > float(start["tabor"])
    assert float(dragged["dwell_time"]) < float(start["dwell_time"])
    assert browsed["dragged"]["boxes"] == dragged
    # Three drags: more drawings than that only come about while the mouse is down.
    assert browsed["redraws"] > 6
    assert browsed["dragged"]["picked"] == ""


def test_keyboard_is_enough(browsed):
    assert browsed["keyed"] > float(browsed["dragged"]["protocol"]["unloading_rate"])
    assert float(browsed["typed"]["protocol"]["unloading_rate"]) == 123.4


def test_downloaded_history_is_that_of_python(browsed, session, folder):
    rows = table(folder / "dragged.csv")
    times, indentations, force = predicted(session, [browsed["dragged"]["protocol"]])
    for name, expected in (("time", times), ("indentation", indentations), ("edge", edge_from_counts(FMS, 1))):
        np.testing.assert_allclose([float(row[name]) for row in rows], expected[0], rtol=1e-9, atol=1e-9)
    scale = np.abs(force).max()
    np.testing.assert_allclose([float(row["force"]) for row in rows], force[0], rtol=TOLERANCE, atol=1e-6 * scale)
    assert [row["phase"] for row in rows] == ["loading"] * 50 + ["dwell"] * 20 + ["unloading"] * 50
    assert browsed["csvName"].endswith(".csv")
    assert "solver_force" not in rows[0]


def test_solver_curve_is_overlaid_with_its_error(browsed, session, curves, folder):
    curve = next(curve for curve in curves["curves"] if curve["name"] == "paper-12")
    assert browsed["preset"]["picked"] == "paper-12"
    _, _, force = predicted(session, [curve["protocol"]])
    expected = nmae(force, np.array([curve["force"]]))[0]
    assert float(browsed["preset"]["error"]) == pytest.approx(expected, rel=TOLERANCE)
    assert [float(row["solver_force"]) for row in table(folder / "preset.csv")] == curve["force"]


def test_list_states_the_error_of_every_curve(browsed, session, curves):
    _, _, force = predicted(session, [curve["protocol"] for curve in curves["curves"]])
    expected = nmae(force, np.array([curve["force"] for curve in curves["curves"]]))
    names, errors = zip(*browsed["list"], strict=True)
    assert list(names) == [curve["name"] for curve in curves["curves"]]
    np.testing.assert_allclose(errors, expected, rtol=TOLERANCE)


def test_link_shares_the_state(browsed):
    assert browsed["shared"]["protocol"] == browsed["typed"]["protocol"]
    assert browsed["shared"]["shown"] | {"inference": ""} == browsed["typed"]["shown"] | {"inference": ""}


def test_out_of_range_is_marked(browsed, session):
    ranges = json.loads(session.get_modelmeta().custom_metadata_map["ranges"])
    assert ranges["tabor"][1] < 5
    assert browsed["outside"]["extrapolation"].endswith("in Tabor parameter.")
    assert browsed["preset"]["extrapolation"] is None


def test_pictures_are_downloaded(browsed, folder):
    picture = (folder / "charts.png").read_bytes()
    assert picture.startswith(b"\x89PNG")
    assert len(picture) > 20_000
    assert browsed["pngName"].endswith(".png")


def test_page_keeps_to_itself_and_is_quiet(browsed):
    assert browsed["foreign"] == []
    assert browsed["errors"] == []
    assert browsed["isolated"] is False


def test_nothing_is_wider_than_a_phone(browsed):
    assert browsed["phone"]["wide"] is False


def test_offline_once_loaded(browsed):
    before, after = browsed["offline"]["before"], browsed["offline"]["after"]
    assert after["protocol"] == before["protocol"]
    assert after["values"]["pull-off-force"] == before["values"]["pull-off-force"]


def test_trouble_is_told_in_a_sentence(browsed):
    assert browsed["missing"] == "The model could not be loaded (./model.onnx answers 404)."
    for case in ("notOnnx", "foreignOnnx"):
        assert browsed[case] == "./model.onnx is not a surrogate of this project: its metadata do not say so."
    assert browsed["noWebAssembly"].startswith("This browser runs no WebAssembly")
    assert browsed["badLink"]["message"].startswith("The link gives tabor = “soft”, which is no usable number.")
    assert browsed["badLink"]["protocol"] == browsed["start"]["protocol"]
    assert browsed["refused"].startswith("Give a number from")
