"""The demonstrator in headless Chromium against Python; run by `make test-demo`, which builds the page first."""

import csv
import json
import struct
import warnings
from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from bem import LoadingProtocol, Scene, StandardLinearSolid
from bem.dataset.pull_off_steps import pull_off_grid
from bem.lab import Setup
from experiments.cases import RANGES
from surrogate import ExtrapolationWarning
from surrogate.data.metrics import nmae
from tests.demo.conftest import DIST

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


def computed(name):
    """The solver's results of a protocol."""
    curves = json.loads((DIST / "solids.json").read_text(encoding="utf-8"))["curves"]
    return next(curve for curve in curves if curve["name"] == name)["results"]


def steps(protocols, pull_off_times):
    """Instants and indentations (batch, steps) around pull-offs."""
    columns = {name: [float(row[name]) for row in protocols] for name in RANGES}
    strengths = 1.0 - np.array(columns.pop("modulus_ratio"))[:, np.newaxis]
    solids = {"strengths": strengths, "retardation_times": np.ones(strengths.shape)}
    return pull_off_grid(**columns, **solids, pull_off_time=pull_off_times)


def solver_force(curves, times):
    """The solver's force at other steps (batch, steps), interpolated phase by phase."""
    protocols, results = ([curve[key] for curve in curves] for key in ("protocol", "results"))
    own, _ = steps(protocols, [row["pull_off_time"] for row in results])
    force = np.empty(own.shape)
    for curve, instants, wanted, row in zip(curves, own, times, force, strict=True):
        for begin, end in pairwise((0, 21, 29, 101)):
            phase = slice(begin, end + 1)
            row[phase] = PchipInterpolator(instants[phase], np.array(curve["force"])[phase])(wanted[phase])
    return force


def changed(one, other):
    """Names of the quantities in which two protocols of links differ."""
    return {name for name in one if float(one[name]) != float(other[name])}


def test_first_picture_is_computed_and_small(browsed):
    """While the file of the model does not arrive: film and force of a computed protocol, within 300 kB."""
    seen = browsed["first"]
    needed = [DIST / name for name in ("index.html", "main.js", "styles.css", "solids.json", "contact-paper-4.json")]
    assert sum(path.stat().st_size for path in needed) < seen["bytes"] < 300_000
    assert not any(name in url for url in seen["asked"] for name in ("fast.bin", "model.onnx", "ort", "curves.json"))
    assert seen["film"]["own"] == "true"
    assert seen["film"]["shown"] == seen["picked"] == "paper-4"
    assert seen["instants"][0] < seen["instants"][1] < seen["instants"][2]
    assert seen["values"]["pull-off-force"] == computed("paper-4")["pull_off_force"]
    assert set(seen["beside"].values()) == {"computed by the solver"}
    # A protocol of one's own has no number before the model is there, and one afterwards.
    assert set(seen["dragged"]["shown"].values()) == {"–"}
    assert seen["after"]["protocol"] == seen["dragged"]["protocol"] != seen["protocol"]
    assert seen["after"]["interval"][0] < seen["after"]["values"]["pull-off-force"] < seen["after"]["interval"][1]


def test_runtime_is_fetched_for_the_model_of_the_paper_only(browsed, model, curves, folder):
    assert not any(name in url for url in browsed["asked"] for name in ("model.onnx", "ort", "/curves.json"))
    seen = browsed["paper"]
    assert seen["address"]["model"] == seen["model"] == "M1-concat"
    assert seen["fixed"] == [["modulus_ratio", "0.1"]]
    assert seen["interval"] is None
    (trajectory,) = python(model, [seen["protocol"]])
    rows = table(folder / "paper.csv")
    for tile, name in TILES.items():
        assert seen["values"][tile] == pytest.approx(getattr(trajectory, name), rel=TOLERANCE)
    scale = np.abs(trajectory.force).max()
    np.testing.assert_allclose(column(rows, "time"), trajectory.time, rtol=1e-14)
    np.testing.assert_allclose(column(rows, "force"), trajectory.force, rtol=TOLERANCE, atol=1e-6 * scale)
    assert [row["phase"] for row in rows] == ["loading"] * 50 + ["dwell"] * 20 + ["unloading"] * 50
    forces = {curve["name"]: curve["force"] for curve in curves["curves"]}
    names, errors = zip(*browsed["paperList"], strict=True)
    predicted = python(model, [curve["protocol"] for curve in curves["curves"]])
    assert list(names) == list(forces)
    expected = nmae(np.array([trajectory.force for trajectory in predicted]), np.array([*forces.values()]))
    np.testing.assert_allclose(errors, expected, rtol=TOLERANCE)
    # Of models chosen in a hurry, the last one stays.
    assert (browsed["hurried"]["address"]["model"], browsed["hurried"]["model"]) == (None, "fast")


@pytest.mark.parametrize("moment", ["start", "dragged", "typed", "shared", "preset", "laboratory", "phone"])
def test_numbers_are_those_of_python(browsed, fast, moment):
    seen = browsed[moment]
    (trajectory,) = python(fast, [seen["protocol"]])
    for tile, name in TILES.items():
        assert seen["values"][tile] == pytest.approx(getattr(trajectory, name), rel=TOLERANCE)
        if moment != "laboratory":
            assert float(seen["shown"][tile].replace("−", "-")) == pytest.approx(seen["values"][tile], rel=TOLERANCE)
    assert seen["interval"] == pytest.approx(trajectory.pull_off_interval, rel=TOLERANCE)


@pytest.mark.parametrize("case", ["usual", "elastic", "quick", "slow", "computed", "dragged"])
def test_downloaded_history_equals_python(browsed, fast, folder, case):
    seen = browsed["dragged"] if case == "dragged" else browsed["cases"][case]
    (expected,) = python(fast, [seen["protocol"]])
    rows = table(folder / f"{case}.csv")
    largest = np.abs(expected.force).max()
    (time,), (indentation,) = steps([seen["protocol"]], [seen["values"]["pull-off-time"]])
    np.testing.assert_allclose(column(rows, "time"), time, rtol=1e-7)
    np.testing.assert_allclose(column(rows, "indentation"), indentation, rtol=1e-7, atol=1e-6)
    assert set(column(rows, "modulus_ratio")) == {float(seen["protocol"]["modulus_ratio"])}
    names = {"force": "force", "force_lower": "force_lower", "force_upper": "force_upper"}
    for name, attribute in names.items():
        np.testing.assert_allclose(
            column(rows, name), getattr(expected, attribute), rtol=TOLERANCE, atol=1e-5 * largest
        )
    assert ("solver_force" in rows[0]) == (case == "computed")
    assert browsed["csvName"].endswith("_fast.csv")


def test_errors_of_computed_protocols_equal_python(browsed, fast, solids, folder):
    expected = python(fast, [curve["protocol"] for curve in solids])
    names, errors, pull_offs = zip(*browsed["list"], strict=True)
    assert list(names) == [curve["name"] for curve in solids]
    true = solver_force(solids, [one.time for one in expected])
    np.testing.assert_allclose(errors, nmae(np.array([one.force for one in expected]), true), rtol=2e-3)
    peaks = np.array([curve["results"]["pull_off_force"] for curve in solids])
    ours = 100.0 * np.abs(np.array([one.pull_off_force for one in expected]) / peaks - 1.0)
    np.testing.assert_allclose(pull_offs, ours, atol=100 * TOLERANCE)
    seen = browsed["preset"]
    assert seen["picked"] == "paper-12"
    assert float(seen["error"]) == errors[names.index("paper-12")]
    rows = table(folder / "preset.csv")
    force = column(rows, "solver_force")
    np.testing.assert_allclose(force, true[names.index("paper-12")], atol=TOLERANCE * np.abs(force).max())
    inside = int(((column(rows, "force_lower") <= force) & (force <= column(rows, "force_upper"))).sum())
    assert f"its force inside the band at {inside} of {len(rows)} steps." in seen["comparison"]


def test_sliders_move_the_protocol(browsed):
    start, dragged = (browsed[moment]["protocol"] for moment in ("start", "dragged"))
    assert changed(start, dragged) == {"tabor", "loading_rate", "dwell_time"}
    assert float(dragged["tabor"]) < float(start["tabor"])
    assert browsed["dragged"]["boxes"] == dragged
    # Three drags: more drawings than that only come about while the mouse is down.
    assert browsed["redraws"] > 6
    assert browsed["dragged"]["picked"] == ""
    assert float(browsed["typed"]["protocol"]["unloading_rate"]) == 123.4


MOVED = {
    "peak": ({"peak_indentation", "loading_rate"}, "peak_indentation", -1),
    "loading": ({"loading_rate"}, "loading_rate", -1),
    "dwell": ({"dwell_time"}, "dwell_time", -1),
    "unloading": ({"unloading_rate"}, "unloading_rate", -1),
    "beyond": ({"dwell_time"}, "dwell_time", 1),
}


@pytest.mark.parametrize("corner", MOVED)
def test_corner_follows_the_pointer_and_the_force_at_once(browsed, fast, corner):
    seen, (names, name, sign) = browsed["corners"][corner], MOVED[corner]
    before, held, after = (seen[moment] for moment in ("before", "held", "after"))
    assert changed(before["protocol"], after["protocol"]) <= names
    assert np.sign(float(after["protocol"][name]) - float(before["protocol"][name])) == sign
    # Before the mouse was up.
    assert held["protocol"] == after["protocol"]
    assert held["values"] == after["values"] != before["values"]
    (trajectory,) = python(fast, [held["protocol"]])
    assert held["values"]["pull-off-force"] == pytest.approx(trajectory.pull_off_force, rel=TOLERANCE)
    if corner == "beyond":
        assert float(after["protocol"]["dwell_time"]) == RANGES["dwell_time"][1]
    elif corner != "peak":
        assert np.abs(held["off"]).max() < 1.0


def test_keys_move_a_corner(browsed):
    before, after = (browsed["keyed"][moment]["protocol"] for moment in ("before", "after"))
    assert changed(before, after) == {"peak_indentation", "loading_rate"}
    assert float(after["peak_indentation"]) == pytest.approx(1.05**2 * float(before["peak_indentation"]), rel=1e-2)
    # Loading is longer by a twentieth and by half.
    assert float(after["loading_rate"]) == pytest.approx(float(before["loading_rate"]) / (1.05 * 1.5), rel=1e-2)
    said = browsed["keyed"]["after"]["corners"][0]
    assert said == f"Loading rate {after['loading_rate']}, Peak indentation {after['peak_indentation']}"


def test_pinned_protocol_is_compared(browsed, fast):
    seen = browsed["typed"]
    pinned = dict(zip(seen["protocol"], seen["address"]["pinned"].split(","), strict=True))
    assert changed(pinned, seen["protocol"]) == {"dwell_time"}
    (trajectory,) = python(fast, [pinned])
    number = float(seen["beside"]["pull-off-force"].removeprefix("predicted by fast; pinned "))
    assert number == pytest.approx(trajectory.pull_off_force, rel=TOLERANCE)
    assert seen["pinned"].startswith("Pinned: μ")
    assert browsed["preset"]["address"]["pinned"] is None


def test_own_protocol_has_the_nearest_film_named_as_that(browsed, solids):
    for seen in (browsed["typed"], browsed["outside"], browsed["film"]["phone"]["nearest"]):
        names = [*seen["protocol"]]
        places = np.log([[curve["protocol"][name] for name in names] for curve in solids])
        own = np.log([float(seen["protocol"][name]) for name in names])
        nearest = np.argmin((((places - own) / np.ptp(places, axis=0)) ** 2).sum(axis=1))
        assert seen["film"]["shown"] == solids[nearest]["name"]
        assert seen["film"]["own"] == "false"
        assert seen["film"]["caption"].startswith("Not your protocol, but the nearest computed one: ")


def test_out_of_range_shows_no_number(browsed):
    seen = browsed["outside"]
    assert seen["outside"] == "No prediction: outside the training range of fast in Tabor parameter (0.2 to 3.2)."
    assert set(seen["shown"].values()) == {"–"}
    assert set(seen["beside"].values()) == {""}
    assert seen["interval"] is None
    assert seen["label"] == "Force against time: no prediction."
    assert browsed["preset"]["outside"] is None
    unlike = browsed["unlike"]
    assert unlike["outside"] == (
        "No prediction: the training of fast covers each of these quantities, but not all of them together."
    )
    assert set(unlike["shown"].values()) == {"–"}
    assert unlike["interval"] is None
    assert browsed["refused"].startswith("Give a number from")


def test_link_restores_the_view(browsed):
    for key in ("protocol", "address", "shown", "beside", "pinned", "view"):
        assert browsed["shared"][key] == browsed["typed"][key]
    assert browsed["start"]["view"] == {"time": "phases", "force": "linear"}
    # Opened from the link of a logarithmic page, with `time=real` and keys of other sites added.
    seen = browsed["viewed"]
    assert seen["view"] == {key: seen["address"][key] for key in ("time", "force")} == {"time": "real", "force": "log"}
    assert seen["protocol"] == browsed["preset"]["protocol"]
    assert seen["message"] is None
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


def test_page_is_quiet_and_makes_pictures(browsed, folder):
    assert browsed["foreign"] == []
    assert browsed["errors"] == []
    assert browsed["isolated"] is False
    for picture in (folder / "charts.png", DIST / "card.png"):
        content = picture.read_bytes()
        assert content.startswith(b"\x89PNG")
        assert len(content) > 20_000
    # Width and height of the picture beside a link.
    assert struct.unpack(">II", content[16:24]) == (1200, 630)
    assert browsed["card"] == "./card.png"
    assert browsed["pngName"].endswith("_fast.png")


def test_phone_shows_contact_and_force_and_keeps_the_force(browsed):
    seen = browsed["phone"]
    # Nothing of the film is off the first screen, and the force follows the finger.
    assert min(seen["film"], seen["history"]) > 0.95
    assert changed(seen["protocol"], seen["after"]["protocol"]) == {"dwell_time"}
    assert seen["pulled"]["values"] == seen["after"]["values"] != seen["values"]
    for window, size in browsed["sizes"].items():
        assert (size["wide"], size["hidden"]) == (False, []), window
        if int(window.partition("x")[0]) < 600:
            assert size["history"] > 0.95, window


@pytest.mark.parametrize("window", ["desk", "phone", "dark"])
def test_film_runs_from_approach_to_release(browsed, window):
    seen = browsed["film"][window]
    pull_off, pull_off_time = (computed("paper-4")[name] for name in ("pull_off_force", "pull_off_time"))
    force = float(seen["start"]["words"].rpartition("P ")[2].replace("−", "-"))
    assert 0.9 * pull_off < force <= 1.01 * pull_off
    assert seen["sight"] > 0.95
    assert seen["apart"]["instant"] == 0 < seen["playing"]["instant"]
    assert (seen["playing"]["button"], seen["paused"]["button"]) == ("Pause the contact", "Play the contact")
    # A link stands where it was copied; another contact is shown at its pull-off again.
    assert seen["linked"] == seen["paused"]
    assert seen["end"]["instant"] == seen["end"]["last"]
    assert float(seen["nearest"]["address"]["instant"]) > pull_off_time
    assert seen["other"]["address"]["instant"] is None
    # Sphere, solid, and a surface whose tractions have many shades.
    assert all(look["colours"] > 100 for look in seen.values() if isinstance(look, dict) and "colours" in look)
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
UNREADABLE = CURVES.format("read: ./solids.json is not what experiments.demo_curves writes")
NO_SCRIPT = "This page needs JavaScript: it is switched off in this browser, or the page’s scripts were not found."
STAYS = " The page shows what the solver has computed."
SENTENCES = {
    "missingFast": "The model could not be loaded (./fast.bin answers 404)." + STAYS,
    "noFast": "The model could not be read: ./fast.bin is not what experiments.demo_model writes." + STAYS,
    "missingContact": "The profiles of the contact could not be loaded (./contact-paper-4.json answers 404). "
    "The page shows the curves without it.",
    "missing": MODEL.format("answers 404") + STAYS,
    "unreachable": MODEL.format("cannot be reached") + STAYS,
    "notOnnx": FOREIGN + STAYS,
    "foreignOnnx": FOREIGN + STAYS,
    "missingPaperCurves": CURVES.format("loaded (./curves.json answers 404)") + STAYS,
    "missingRuntime": "ONNX Runtime could not be loaded (./ort.wasm answers 404)." + STAYS,
    "badRuntime": "The model could not be started: ./ort.wasm or ./model.onnx is damaged, "
    "or this browser is too old for them." + STAYS,
    "noWebAssembly": "This browser runs no WebAssembly, which this model needs; switch it on, "
    "or use a current browser." + STAYS,
    "missingCurves": CURVES.format("loaded (./solids.json answers 404)"),
    "noJson": UNREADABLE,
    "noCurves": UNREADABLE,
    "cutCurves": UNREADABLE,
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
        ("time=real&time=phases", "The link gives time more than once."),
        ("model=slow", "The link gives model = “slow”, which is neither fast nor M1-concat."),
        (
            "modulus_ratio=0.3&model=M1-concat",
            "The link gives modulus_ratio = “0.3”, but M1-concat knows 0.1 only.",
        ),
        ("instant=soon", "The link gives instant = “soon”, which is no usable number."),
        ("pinned=1,2", "The link gives pinned = “1,2”, which must be 6 numbers."),
        ("pinned=1,2,3,4,5,soft", "The link gives pinned = “soft”, which is no usable number."),
        ("modulus_ratio=2", "The link gives modulus_ratio = “2”, which is no usable number."),
    ],
)
def test_unusable_link_gives_one_sentence(browsed, fragment, sentence):
    """The driver also waits for the sentence to go with the next change."""
    seen = browsed["badLinks"][fragment]
    assert seen["message"].startswith(sentence)
    assert seen["protocol"] == browsed["start"]["protocol"]
