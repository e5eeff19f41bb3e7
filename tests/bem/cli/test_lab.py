"""The commands in SI units write what they promise, or one sentence and nothing."""

import dataclasses
import json

import matplotlib as mpl
import numpy as np
import pytest
from typer.testing import CliRunner

from bem import PronySeries
from bem._support.command_line import run_command
from bem.cli.app import app
from bem.lab import ForceCurve
from bem.lab.maps import plot_map, read_map, to_xarray
from experiments.robustness.lab_curves import CLASSES, write_map
from tests.bem.lab.measurement import BEAD, TRUTH, measured
from tests.processes import succeeded

CONTACT = {
    "radius": "50e-6",
    "work-of-adhesion": "0.05",
    "modulus": "2e6",
    "peak-indentation": "3e-7",
    "loading-rate": "2e-6",
    "unloading-rate": "2e-6",
    "retardation-time": "0.1",
    "material": "sls:0.3",
    "accuracy": "draft",
}


def options(*extra, **changes):
    named = CONTACT | {name.replace("_", "-"): value for name, value in changes.items()}
    return [word for name, value in named.items() for word in (f"--{name}", value)] + list(extra)


def test_simulate_with_a_radius_is_in_si(tmp_path):
    path = tmp_path / "a.csv"
    result = succeeded(app, ["simulate", *options(csv=str(path))])
    assert "detached         no, still attached at the end" in result.output
    assert "the pull-off force depends on the effective range" in result.output
    curve = ForceCurve.read(path)
    assert 5e-6 < curve.pull_off_force < 4e-5
    assert curve.indentation.max() == pytest.approx(3e-7)


def test_the_result_in_si_is_json_on_request(tmp_path):
    path = tmp_path / "a.csv"
    found = json.loads(succeeded(app, ["simulate", "--json", *options(csv=str(path))]).stdout)
    curve = ForceCurve.read(path)
    np.testing.assert_allclose(found["force"], curve.force, rtol=1e-8)
    assert (found["force_sign"], found["detached"]) == ("tension", False)
    assert found["pull_off_force"] == pytest.approx(curve.pull_off_force)


def test_units_are_understood_in_the_command():
    plain = CliRunner().invoke(app, ["simulate-si", *options()])
    units = {"radius": "50um", "work_of_adhesion": "50mJ/m2", "modulus": "2MPa", "peak_indentation": "300 nm"}
    named = succeeded(app, ["simulate", *options(loading_rate="2um/s", retardation_time="100ms", **units)])
    assert plain.output == named.output


def test_a_material_may_be_an_entry_of_the_library(tmp_path):
    words = [word for word in options() if word not in ("--retardation-time", "0.1", "--material", "sls:0.3")]

    def said(*more):
        return succeeded(app, ["simulate-si", *words, *more]).output

    assert said("--material", "sylgard_184") == said("--material", "elastic")
    # Its modulus is the default.
    words = [word for word in words if word not in ("--modulus", "2e6")]
    assert said("--material", "sylgard_184") == said("--modulus", "2.05e6")
    words = ["--tabor", "0.5", "--peak-indentation", "2", "--loading-rate", "10", "--unloading-rate", "10"]
    succeeded(app, ["simulate", *words, "--material", "sylgard_184_cured_at_100c"])


def test_a_fit_holds_a_known_prony_series(tmp_path):
    """The relaxation is the material's; modulus and adhesion are found."""
    series = BEAD.replaced(material=PronySeries([0.7], [0.1]), retardation_time=None)
    measured(series).shifted(contact_point=TRUTH["contact_point"]).write(tmp_path / "curve.csv")
    words = ["fit", str(tmp_path / "curve.csv"), "--radius", "50um", "--material", "prony:0.7@0.1"]
    words += ["--model", "solver", "--accuracy", "draft", "--out", str(tmp_path / "fit.json")]
    succeeded(app, words)
    found = json.loads((tmp_path / "fit.json").read_text())["values"]
    assert "retardation_time" not in found
    assert found["relaxed_modulus"] == pytest.approx(2e6, rel=0.03)
    assert found["work_of_adhesion"] == pytest.approx(0.05, rel=0.05)


def failed(arguments, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["bem", *arguments])
    with pytest.raises(SystemExit) as left:
        run_command(app, "bem")
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("bem: ")
    assert said.err.count("\n") == 1
    return left.value.code, said.err


@pytest.mark.parametrize(
    ("changes", "status", "message"),
    [
        ({"radius": "-1"}, 2, "radius must be a finite number greater than 0"),
        ({"radius": "many"}, 2, "radius must be a length, such as '50 um'; received 'many'"),
        ({"unloading_rate": "-1e-6"}, 2, "(in 86.67 nm and 100 ms)"),
        ({"plot": "a.doc"}, 2, "Expected an output file called .png"),
        ({"force_sign": "up"}, 2, "force_sign must be 'tension' or 'compression'"),
        ({"largest_tabor": "50", "accuracy": "2e-5"}, 1, "the simulation did not complete: not started"),
    ],
)
def test_a_contact_that_is_none_is_one_sentence_and_writes_nothing(
    tmp_path, monkeypatch, capsys, changes, status, message
):
    path = tmp_path / "a.csv"
    code, said = failed(["simulate", *options(csv=str(path), **changes)], monkeypatch, capsys)
    assert code == status
    assert message in said
    assert not list(tmp_path.iterdir())


def test_fit_writes_its_json_and_its_picture(tmp_path):
    measured().shifted(contact_point=TRUTH["contact_point"]).write(tmp_path / "curve.csv")
    out, plot = tmp_path / "fit.json", tmp_path / "fit.png"
    words = ["fit", str(tmp_path / "curve.csv"), "--radius", "50e-6", "--free", "work_of_adhesion,force_offset"]
    words += ["--modulus", "2e6", "--material", "sls:0.3", "--retardation-time", "0.1", "--accuracy", "draft"]
    result = succeeded(app, [*words, "--out", str(out), "--plot", str(plot)])
    found = json.loads(out.read_text())
    assert found["values"]["work_of_adhesion"] == pytest.approx(0.05, rel=0.05)
    assert f"{1e3 * found['values']['work_of_adhesion']:.4g} mJ/m^2" in result.output
    assert plot.stat().st_size > 1000


COLUMNS = "time (s),indentation (m)"


@pytest.mark.parametrize(
    ("header", "options", "message"),
    [
        (COLUMNS, [], "Expected a column force"),
        (f"{COLUMNS},force (N)", [], "the curve shows no contact"),
        (f"{COLUMNS},force (N)", ["--free", "colour"], "the curve shows no contact"),
        (f"{COLUMNS},force (N)", ["--plot", "a.txt"], "Expected an output file called .png"),
        (f"{COLUMNS},force (N)", ["--material", "rubber"], "or an entry of the materials library"),
        (
            f"{COLUMNS},force (N)",
            ["--material", "sylgard_184", "--retardation-time", "1s"],
            "retardation_time must not be given with sylgard_184_cured_at_100c, whose times are in seconds",
        ),
        (f"{COLUMNS},force (N)", ["--out", "a.txt"], "Expected an output file called .json"),
        (f"{COLUMNS},force (N)", ["--radius", "0"], "radius must be a finite number greater than 0"),
        (f"{COLUMNS},force (kg)", [], "must be a force, in a unit such as N; received the unit 'kg'"),
        ("time (s),displacement (m),force (N)", [], "Expected the stiffness"),
    ],
)
def test_a_measurement_that_is_none_is_one_sentence_and_writes_nothing(
    tmp_path, monkeypatch, capsys, header, options, message
):
    path = tmp_path / "curve.csv"
    time = np.linspace(0.0, 1.0, 60)
    columns = [time, np.minimum(time, 1.0 - time), 1e-9 * np.random.default_rng(0).standard_normal(60)]
    np.savetxt(path, np.column_stack(columns[: header.count(",") + 1]), delimiter=",", header=header, comments="")
    outputs = ["--out", str(tmp_path / "fit.json"), "--plot", str(tmp_path / "fit.png")]
    code, said = failed(["fit", str(path), "--radius", "50e-6", *outputs, *options], monkeypatch, capsys)
    assert code == 2
    assert message in said
    assert list(tmp_path.iterdir()) == [path]


def test_a_stiffness_moves_the_stage(tmp_path):
    path = tmp_path / "a.csv"
    succeeded(app, ["simulate", *options(csv=str(path), stiffness="50", material="elastic")])
    curve = ForceCurve.read(path)
    assert curve.stage.max() == pytest.approx(3e-7)
    np.testing.assert_allclose(curve.stage, curve.indentation - curve.force / 50.0, atol=1e-14)


def test_forces_in_place_of_a_cycle(tmp_path):
    given = {name: CONTACT[name] for name in ("radius", "work-of-adhesion", "modulus", "accuracy")}
    words = [word for name, value in given.items() for word in (f"--{name}", value)]
    plot = tmp_path / "creep.png"
    run = succeeded(app, ["simulate", *words, "--times", "0,1,2", "--forces", "0,-5e-6,2e-5", "--plot", str(plot)])
    assert plot.stat().st_size > 10_000
    assert "pull-off force" in run.output
    held = ["--times", "0,1,2", "--forces", "0,-5e-6,-5e-6", "--material", "sls:0.3", "--retardation-time", "1"]
    assert "pull-off force   none" in succeeded(app, ["simulate", *words, *held]).output
    assert "are the units right?" in succeeded(app, ["simulate", *words, "--modulus", "20", *held]).output
    refused = CliRunner().invoke(app, ["simulate-si", *words, "--times", "0,1"])
    assert "times and forces must be given together" in str(refused.exception)


def afm_map(path, count=3):
    """A file of several curves behind cantilevers, of which the second is noise."""
    pytest.importorskip("afmformats")
    curves = []
    for number in range(count):
        rng = np.random.default_rng(number)
        curve, _, _ = CLASSES["jkr"](rng, noise=0.005)
        if number == 1:
            noise = rng.standard_normal(len(curve)) * 1e-9
            curve = dataclasses.replace(curve, force=noise, indentation=curve.stage + noise / curve.stiffness)
        curves.append(curve)
    write_map(path, curves)
    return path


def test_a_file_of_several_curves_is_never_silently_one(tmp_path, monkeypatch, capsys):
    path = afm_map(tmp_path / "map.h5")
    words = ["fit", str(path), "--radius", "5um", "--force-sign", "compression"]
    code, said = failed(words, monkeypatch, capsys)
    assert code == 2
    assert "the number of a curve must be given, from 0 to 2" in said
    assert "from 0 to 2; received 7" in failed([*words, "--number", "7"], monkeypatch, capsys)[1]
    result = succeeded(app, [*words, "--number", "2", "--model", "jkr", "--segment", "retract"])
    assert "JKR: elastic sphere" in result.output


def test_a_map_is_one_line_a_curve_and_goes_on_where_it_was(tmp_path):
    path, out, plot = afm_map(tmp_path / "map.h5"), tmp_path / "map.csv", tmp_path / "map.png"
    words = ["fit-map", str(path), "--radius", "5um", "--out", str(out), "--plot", str(plot)]
    result = succeeded(app, words)
    assert "3 curves: 2 jkr" in result.output
    assert "1 without a fit: the curve shows no contact" in result.output
    assert plot.stat().st_size > 1000
    rows = read_map(out)
    assert [row["number"] for row in rows] == [0, 1, 2]
    assert rows[2]["relaxed_modulus_low"] < rows[2]["relaxed_modulus"] < rows[2]["relaxed_modulus_high"]
    assert rows[2]["x"] == pytest.approx(2e-6)
    assert rows[1]["reason"].startswith("the curve shows no contact")
    assert to_xarray(rows)["model"].values.tolist() == ["jkr", "", "jkr"]
    for nowhere in ({}, {"x": np.nan}):
        with mpl.rc_context({"svg.fonttype": "none"}):
            plot_map([row | nowhere | ({"adequate": "no"} if row["model"] else {}) for row in rows], tmp_path / "m.svg")
        drawn = (tmp_path / "m.svg").read_text(encoding="utf-8")
        assert ("no fit" in drawn, "no adequate model" in drawn) == (True, True)
    # What an interruption left: two lines, and half of the third.
    whole = out.read_text()
    lines = whole.splitlines(keepends=True)
    out.write_text("".join(lines[:4]) + lines[4][:20])
    assert CliRunner().invoke(app, words).exit_code == 0
    assert out.read_text() == whole
    other = CliRunner().invoke(app, [*words, "--model", "hertz"])
    assert "the settings of" in other.output
    # The relaxation of a known solid is held, and its Poisson's ratio is the default.
    solid = [*words[:4], "--out", str(tmp_path / "solid.csv"), "--model", "jkr", "--material", "polyurea"]
    assert CliRunner().invoke(app, solid).exit_code == 0
    assert '"material": "PronySeries(' in (tmp_path / "solid.csv").read_text().splitlines()[0]
    assert read_map(tmp_path / "solid.csv")[2]["relaxed_modulus"] == pytest.approx(rows[2]["relaxed_modulus"], rel=0.1)
    (tmp_path / "no.csv").write_text("a,b")
    assert "which is none" in CliRunner().invoke(app, [*words[:-3], str(tmp_path / "no.csv")]).output


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--range", "1um"], "range must be LOW:HIGH"),
        (["--quantity", "colour"], "quantity must be one of relaxed_modulus"),
        (["--model", "sphere"], "model must be auto or one of hertz"),
        (["--material", "sls:0.3"], "material must be one of Elastic(...), PronySeries(...)"),
    ],
)
def test_options_of_a_map_that_are_none(tmp_path, words, message):
    path = afm_map(tmp_path / "map.h5", count=1)
    run = CliRunner().invoke(app, ["fit-map", str(path), "--radius", "5um", "--out", str(tmp_path / "m.csv"), *words])
    assert message in str(run.exception) + run.output
