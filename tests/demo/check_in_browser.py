"""The demonstrator in headless Chromium against Python; run by `make test-demo`, which builds the page first."""

import csv
import warnings

import numpy as np
import pytest

from bem import LoadingProtocol, Scene, StandardLinearSolid
from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import FMS
from bem.lab import Setup
from surrogate import ExtrapolationWarning
from surrogate.data.features import edge_from_counts
from surrogate.data.metrics import nmae

TOLERANCE = 1e-4
TILES = {"pull-off-force": "pull_off_force", "pull-off-time": "pull_off_time", "hysteresis": "hysteresis"}
"""Numbers of the page, by the names of those of Python."""


def python(model, protocols):
    """Trajectories of protocols as the page names them; the modulus ratio of the paper is not named."""
    rows = [{"modulus_ratio": 0.1} | {name: float(value) for name, value in protocol.items()} for protocol in protocols]
    scenes = [Scene(row.pop("tabor"), StandardLinearSolid(row.pop("modulus_ratio"))) for row in rows]
    with warnings.catch_warnings(action="ignore", category=ExtrapolationWarning):
        return model.predict(scenes, [LoadingProtocol(**row) for row in rows])


def table(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def column(rows, name):
    return np.array([float(row[name]) for row in rows])


@pytest.mark.parametrize("moment", ["start", "dragged", "typed", "shared", "preset", "outside", "phone"])
def test_numbers_are_those_of_python(browsed, model, moment):
    seen = browsed[moment]
    (trajectory,) = python(model, [seen["protocol"]])
    for tile, name in TILES.items():
        expected = pytest.approx(getattr(trajectory, name), rel=TOLERANCE)
        assert seen["values"][tile] == expected
        assert float(seen["shown"][tile].replace("−", "-")) == expected


def test_dragging_and_keys_move_the_protocol(browsed):
    start, dragged = (browsed[moment]["protocol"] for moment in ("start", "dragged"))
    assert {name for name in QUANTITIES if start[name] != dragged[name]} == {"tabor", "loading_rate", "dwell_time"}
    assert float(dragged["tabor"]) > float(start["tabor"])
    assert float(dragged["dwell_time"]) < float(start["dwell_time"])
    assert browsed["dragged"]["boxes"] == dragged
    # Three drags: more drawings than that only come about while the mouse is down.
    assert browsed["redraws"] > 6
    assert browsed["dragged"]["picked"] == ""
    assert browsed["keyed"] > float(dragged["unloading_rate"])
    assert float(browsed["typed"]["protocol"]["unloading_rate"]) == 123.4


def test_downloaded_history_equals_python(browsed, model, folder):
    rows = table(folder / "dragged.csv")
    (trajectory,) = python(model, [browsed["dragged"]["protocol"]])
    (edge,) = edge_from_counts(FMS, 1)
    for name, expected in (("time", trajectory.time), ("indentation", trajectory.indentation), ("edge", edge)):
        np.testing.assert_allclose(column(rows, name), expected, rtol=1e-14, atol=1e-15)
    scale = np.abs(trajectory.force).max()
    force = column(rows, "force")
    np.testing.assert_allclose(force, trajectory.force, rtol=TOLERANCE, atol=1e-6 * scale)
    # Every digit of the page's own numbers.
    assert max(force[FMS[0] + FMS[1] - 1 :]) == browsed["dragged"]["values"]["pull-off-force"]
    assert [row["phase"] for row in rows] == ["loading"] * 50 + ["dwell"] * 20 + ["unloading"] * 50
    assert browsed["csvName"].endswith(".csv")
    assert "solver_force" not in rows[0]


def test_errors_of_solver_curves_are_stated(browsed, model, curves, folder):
    forces = {curve["name"]: curve["force"] for curve in curves["curves"]}
    trajectories = python(model, [curve["protocol"] for curve in curves["curves"]])
    expected = nmae(np.array([trajectory.force for trajectory in trajectories]), np.array([*forces.values()]))
    names, errors = zip(*browsed["list"], strict=True)
    assert list(names) == list(forces)
    np.testing.assert_allclose(errors, expected, rtol=TOLERANCE)
    assert browsed["preset"]["picked"] == "paper-12"
    assert float(browsed["preset"]["error"]) == pytest.approx(expected[names.index("paper-12")], rel=TOLERANCE)
    assert column(table(folder / "preset.csv"), "solver_force").tolist() == forces["paper-12"]


def test_link_shares_state_view_and_units(browsed):
    assert browsed["shared"]["protocol"] == browsed["typed"]["protocol"]
    assert browsed["shared"]["shown"] | {"inference": ""} == browsed["typed"]["shown"] | {"inference": ""}
    usual = {"time": "steps", "force": "linear"}
    assert browsed["start"]["view"] == browsed["shared"]["view"] == usual
    assert browsed["shared"]["address"] == {"time": None, "force": None}
    # Opened from the link of a logarithmic page, with `time=real` and keys of other sites added.
    assert browsed["viewed"]["view"] == browsed["viewed"]["address"] == {"time": "real", "force": "log"}
    assert browsed["viewed"]["protocol"] == browsed["preset"]["protocol"]
    assert browsed["viewed"]["message"] is None
    assert browsed["laboratory"]["contact"]["units"] == "laboratory"
    assert browsed["linked"]["contact"] == browsed["laboratory"]["contact"]
    assert browsed["linked"]["units"] == browsed["laboratory"]["units"]
    assert browsed["start"]["contact"] == {}
    assert browsed["sketch"] == 200


def test_units_are_those_of_bem_lab(browsed, folder):
    seen = browsed["laboratory"]
    quantities = {name: float(value) for name, value in seen["protocol"].items()}
    # Poisson's ratio belongs to the modulus here: the page takes the plane-strain one.
    setup = Setup(
        radius=5e-8,
        work_of_adhesion=0.05,
        relaxed_modulus=5e8,
        poisson_ratio=0.0,
        retardation_time=0.01,
        largest_tabor=quantities["tabor"],
    )
    assert setup.tabor == quantities["tabor"]
    scales = ((setup.force_scale, "N"), (0.01, "s"), (setup.force_scale * setup.indentation_scale, "J"))
    prefixes = {"a": 1e-18, "f": 1e-15, "p": 1e-12, "n": 1e-9, "µ": 1e-6, "m": 1e-3, "": 1.0}
    for name, (scale, unit) in zip(TILES, scales, strict=True):
        prefix = seen["units"][name].removesuffix(unit)
        value = float(seen["shown"][name].replace("−", "-")) * prefixes[prefix]
        assert value == pytest.approx(seen["values"][name] * scale, rel=1e-4)
    rows = table(folder / "laboratory.csv")
    units = {"force_N": setup.force_scale, "indentation_m": setup.indentation_scale, "time_s": 0.01}
    for name, unit in units.items():
        np.testing.assert_allclose(column(rows, name), unit * column(rows, name.partition("_")[0]), rtol=1e-9)


def test_numbers_out_of_range_are_marked(browsed, model):
    assert model.scaling.ranges["tabor"][1] < 5
    assert browsed["outside"]["extrapolation"].endswith("in Tabor parameter.")
    assert browsed["preset"]["extrapolation"] is None
    assert browsed["refused"].startswith("Give a number from")


def test_page_is_quiet_and_makes_pictures(browsed, folder):
    assert browsed["foreign"] == []
    assert browsed["errors"] == []
    assert browsed["isolated"] is False
    assert browsed["phone"]["wide"] is False
    picture = (folder / "charts.png").read_bytes()
    assert picture.startswith(b"\x89PNG")
    assert len(picture) > 20_000
    assert browsed["pngName"].endswith(".png")


def test_focused_control_is_visible_on_phone(browsed):
    assert browsed["hidden"] == {window: [] for window in browsed["hidden"]}
    assert browsed["stays"] == {window: window in ("390x844", "375x667") for window in browsed["hidden"]}
    for window in ("390x844", "375x667", "667x375", "844x390"):
        assert browsed["visible"][window] > 0.95, window
    assert browsed["scroller"] == 0
    assert browsed["noScroller"] == -1


@pytest.mark.parametrize("window", ["desk", "phone", "dark"])
def test_film_runs_from_approach_to_release(browsed, curves, window):
    seen = browsed["film"][window]
    pull_off = next(curve for curve in curves["curves"] if curve["name"] == "paper-4")["results"]["pull_off_force"]
    force = float(seen["start"]["words"].rpartition("P ")[2].replace("−", "-"))
    assert 0.9 * pull_off < force <= 1.01 * pull_off
    assert seen["apart"]["instant"] == 0 < seen["playing"]["instant"]
    assert (seen["playing"]["button"], seen["paused"]["button"]) == ("Pause the contact", "Play the contact")
    assert seen["end"]["instant"] == seen["end"]["last"]
    # Sphere, solid, and a surface whose tractions have many shades.
    assert all(look["colours"] > 100 for look in seen.values() if isinstance(look, dict))
    assert seen["findings"] == []


def test_two_copies_work_offline_once_loaded(browsed):
    before, after = browsed["offline"]["before"], browsed["offline"]["after"]
    assert after["protocol"] == before["protocol"]
    assert after["values"]["pull-off-force"] == before["values"]["pull-off-force"]
    assert browsed["caches"] == ["contact /a/#one", "contact /b/#other"]
    assert browsed["twin"]["protocol"] == browsed["start"]["protocol"]


MODEL = "The model could not be loaded (./model.onnx {})."
FOREIGN = "./model.onnx is not a surrogate of this project: its metadata do not say so."
CURVES = "The solver curves could not be {}."
UNREADABLE = CURVES.format("read: ./curves.json is not what experiments.demo_curves writes")
NO_SCRIPT = "This page needs JavaScript: it is switched off in this browser, or the page’s scripts were not found."
SENTENCES = {
    "missing": MODEL.format("answers 404"),
    "unreachable": MODEL.format("cannot be reached"),
    "notOnnx": FOREIGN,
    "foreignOnnx": FOREIGN,
    "missingCurves": CURVES.format("loaded (./curves.json answers 404)"),
    "noJson": UNREADABLE,
    "noCurves": UNREADABLE,
    "cutCurves": UNREADABLE,
    "missingRuntime": "ONNX Runtime could not be loaded (./ort.wasm answers 404).",
    "badRuntime": "The model could not be started: ./ort.wasm or ./model.onnx is damaged, "
    "or this browser is too old for them.",
    "noWebAssembly": "This browser runs no WebAssembly, which the surrogate needs; switch it on, "
    "or use a current browser.",
    "missingScript": "The page could not load its script (./main.js); load the page again.",
    "badScript": "This browser cannot run the page’s script (./main.js); use a current browser.",
    "noModules": "This browser knows no JavaScript modules, which the page is made of; use a current browser.",
    "file": "Opened as a file, the page cannot load its model; serve its folder, "
    "for instance with python3 -m http.server.",
    "noScript": NO_SCRIPT,
    "noBoot": NO_SCRIPT,
}


@pytest.mark.parametrize("trouble", SENTENCES)
def test_trouble_is_told_in_a_sentence(browsed, trouble):
    assert browsed["messages"][trouble] == SENTENCES[trouble]


@pytest.mark.parametrize(
    ("fragment", "sentence"),
    [
        ("tabor=soft", "The link gives tabor = “soft”, which is no usable number."),
        ("tabor=0x1", "The link gives tabor = “0x1”, which is no usable number."),
        ("tabor=1&tabor=2", "The link gives tabor more than once."),
        ("force=cubic", "The link gives force = “cubic”, which is neither linear nor log."),
        ("time=real&time=steps", "The link gives time more than once."),
        ("model=slow", "The link gives model = “slow”, which is neither M1-concat nor fast nor accurate."),
        ("modulus_ratio=0.3", "The link gives modulus_ratio = “0.3”, but M1-concat knows 0.1 only; add model=fast"),
        ("model=fast&modulus_ratio=2", "The link gives modulus_ratio = “2”, which is no usable number."),
    ],
)
def test_unusable_link_gives_one_sentence(browsed, fragment, sentence):
    """The driver also waits for the sentence to go with the next change."""
    seen = browsed["badLinks"][fragment]
    assert seen["message"].startswith(sentence)
    assert seen["protocol"] == browsed["start"]["protocol"]
