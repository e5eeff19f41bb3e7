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
from experiments.robustness.lab_curves import write_map
from tests.bem.lab.measurement import BEAD, TRUTH, closed_form, measured
from tests.processes import succeeded

CONTACT = {"radius": "50e-6", "work_of_adhesion": "0.05", "modulus": "2e6", "accuracy": "draft"}
CYCLE = {"peak_indentation": "3e-7", "loading_rate": "2e-6", "unloading_rate": "2e-6"}
SOLID = {"retardation_time": "0.1", "material": "sls:0.3"}


def options(named):
    """Words of options; one that is `None` is left out."""
    given = {name.replace("_", "-"): str(value) for name, value in named.items() if value is not None}
    return [word for name, value in given.items() for word in (f"--{name}", value)]


def simulated(*flags, command="simulate", **changes):
    return succeeded(app, [command, *flags, *options(CONTACT | CYCLE | SOLID | changes)])


def test_simulate_with_a_radius_is_in_si_with_units_and_json_on_request(tmp_path):
    output = simulated(csv=tmp_path / "a.csv").output
    assert "still attached at the end" in output
    assert "the pull-off force depends on the effective range" in output
    curve = ForceCurve.read(tmp_path / "a.csv")
    assert 5e-6 < curve.pull_off_force < 4e-5
    assert curve.indentation.max() == pytest.approx(3e-7)
    found = json.loads(simulated("--json").stdout)
    np.testing.assert_allclose(found["force"], curve.force, rtol=1e-8)
    assert (found["force_sign"], found["detached"]) == ("tension", False)
    assert found["pull_off_force"] == pytest.approx(curve.pull_off_force)
    units = {"radius": "50um", "work_of_adhesion": "50mJ/m2", "modulus": "2MPa", "peak_indentation": "300 nm"}
    units |= {"loading_rate": "2um/s", "retardation_time": "100ms", "csv": tmp_path / "a.csv"}
    assert simulated(command="simulate-si", **units).output == output


def test_a_material_may_be_an_entry_of_the_library():
    said = [
        simulated(retardation_time=None, material=material, modulus=modulus).output
        for modulus, material in (
            *(("2e6", "sylgard_184"), ("2e6", "elastic")),
            *((None, "sylgard_184"), ("2.05e6", "elastic")),  # its modulus is the default
        )
    ]
    assert (said[0], said[2]) == (said[1], said[3])
    cycle = {"peak_indentation": "2", "loading_rate": "10", "unloading_rate": "10"}
    succeeded(app, ["simulate", *options({"tabor": "0.5", "material": "sylgard_184_cured_at_100c"} | cycle)])


def test_a_fit_holds_a_known_prony_series(tmp_path):
    """The relaxation is the material's; modulus and adhesion are found."""
    series = BEAD.replaced(material=PronySeries([0.7], [0.1]), retardation_time=None)
    measured(series).shifted(contact_point=TRUTH["contact_point"]).write(tmp_path / "curve.csv")
    named = {"radius": "50um", "material": "prony:0.7@0.1", "model": "solver", "accuracy": "draft"}
    succeeded(app, ["fit", str(tmp_path / "curve.csv"), *options(named | {"out": tmp_path / "fit.json"})])
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


OPTIONS = {
    "simulate": CONTACT | CYCLE | SOLID | {"csv": "a.csv"},
    "fit curve.csv": {"radius": "50e-6", "out": "fit.json", "plot": "fit.png"},
    "fit-map curve.csv": {"radius": "5um", "out": "m.csv"},
    "campaign": {"count": "3", "out": "-"},
    "merge a.h5": {"out": "-"},
}


@pytest.mark.parametrize(
    ("command", "changes", "message"),
    [
        ("simulate", {"radius": "-1"}, "radius must be a finite number greater than 0"),
        ("simulate", {"radius": "many"}, "radius must be a length, such as '50 um'; received 'many'"),
        ("simulate", {"unloading_rate": "-1e-6"}, "(in 86.67 nm and 100 ms)"),
        ("simulate", {"plot": "a.doc"}, "Expected an output file called .png"),
        ("simulate", {"force_sign": "up"}, "force_sign must be 'tension' or 'compression'"),
        ("simulate", {"largest_tabor": "50", "accuracy": "2e-5"}, "the simulation did not complete: not started"),
        ("simulate", {"csv": "-"}, "which cannot be standard output; received -"),
        ("campaign", {}, "Expected an output file called .h5 or .hdf5; received -"),
        ("merge a.h5", {}, "Expected an output file called .h5 or .hdf5; received -"),
        ("fit curve.csv", {}, "the curve shows no contact"),
        ("fit curve.csv", {"plot": "a.txt"}, "Expected an output file called .png"),
        *(("fit curve.csv", {"out": name}, "Expected an output file called .json") for name in ("a.txt", "-")),
        ("fit curve.csv", {"material": "rubber"}, "or an entry of the materials library"),
        (
            *("fit curve.csv", {"material": "sylgard_184", "retardation_time": "1s"}),
            "must not be given with sylgard_184_cured_at_100c, whose times are in seconds",
        ),
        ("fit curve.csv", {"radius": "0"}, "radius must be a finite number greater than 0"),
        ("fit-map curve.csv", {"range": "1um"}, "range must be LOW:HIGH"),
        ("fit-map curve.csv", {"radius": "0um"}, "radius must be a finite number greater than 0; received 0.0"),
        ("fit-map curve.csv", {"poisson_ratio": "0.7"}, "poisson_ratio must be a finite number at least 0 and at most"),
        ("fit-map curve.csv", {"quantity": "colour"}, "quantity must be one of relaxed_modulus"),
        ("fit-map curve.csv", {"model": "sphere"}, "model must be auto or one of hertz"),
        ("fit-map curve.csv", {"model": "cone"}, "half_angle must be given for a cone or a pyramid; received None"),
        ("fit-map curve.csv", {"segment": "middle"}, "segment must be one of both, approach, retract; received"),
        ("fit-map curve.csv", {"range": "2kg:"}, "range must be a force"),
        ("fit-map curve.csv", {"force_sign": "up"}, "force_sign must be 'tension' or 'compression'; received 'up'"),
        ("fit-map curve.csv", {"material": "sls:0.3"}, "material must be one of Elastic(...), PronySeries(...)"),
    ],
)
def test_a_mistake_is_one_sentence_and_writes_nothing(tmp_path, monkeypatch, capsys, command, changes, message):
    monkeypatch.chdir(tmp_path)
    time = np.linspace(0.0, 1.0, 60)
    noise = 1e-9 * np.random.default_rng(0).standard_normal(60)
    ForceCurve(time=time, indentation=np.minimum(time, 1.0 - time), force=noise).write("curve.csv")
    words = [*command.split(), *options(OPTIONS[command] | changes)]
    code, said = failed(words, monkeypatch, capsys)
    assert code == (1 if "did not complete" in message else 2)
    assert message in said
    assert list(tmp_path.iterdir()) == [tmp_path / "curve.csv"]


def test_fit_writes_its_json_and_its_picture(tmp_path):
    curve, setup, truth = closed_form("jkr", 3)
    curve.write(tmp_path / "curve.csv")
    named = {"radius": setup.radius, "modulus": truth["relaxed_modulus"], "model": "jkr"} | SOLID
    named |= {"free": "work_of_adhesion,contact_point,force_offset,tilt,drag"}
    named |= {"out": tmp_path / "fit.json", "plot": tmp_path / "fit.png"}
    result = succeeded(app, ["fit", str(tmp_path / "curve.csv"), *options(named)])
    found = json.loads((tmp_path / "fit.json").read_text())
    assert found["values"]["work_of_adhesion"] == pytest.approx(truth["work_of_adhesion"], rel=0.05)
    assert f"{1e3 * found['values']['work_of_adhesion']:.4g} mJ/m^2" in result.output
    assert (tmp_path / "fit.png").stat().st_size > 1000


def test_a_stiffness_moves_the_stage(tmp_path):
    simulated(csv=tmp_path / "a.csv", stiffness="50", material="elastic")
    curve = ForceCurve.read(tmp_path / "a.csv")
    assert curve.stage.max() == pytest.approx(3e-7)
    np.testing.assert_allclose(curve.stage, curve.indentation - curve.force / 50.0, atol=1e-14)


def test_forces_in_place_of_a_cycle(tmp_path):
    plot, forces = tmp_path / "creep.png", dict.fromkeys(CYCLE) | {"times": "0,1,2", "forces": "0,-5e-6,2e-5"}
    output = simulated(**forces, material=None, retardation_time=None, plot=plot).output
    assert plot.stat().st_size > 10_000
    assert "pull-off force" in output
    held = forces | {"forces": "0,-5e-6,-5e-6", "retardation_time": "1"}
    assert "pull-off force (tension)   none" in simulated(**held).output
    assert "are the units right?" in simulated(**held, modulus="20").output
    refused = CliRunner().invoke(app, ["simulate-si", *options(CONTACT | {"times": "0,1"})])
    assert "times and forces must be given together" in str(refused.exception)


def afm_map(path):
    """A file of three curves behind cantilevers, of which the second is noise."""
    pytest.importorskip("afmformats")
    curves = []
    for number in range(3):
        curve, _, _ = closed_form("jkr", number, noise=0.005)
        if number == 1:
            noise = np.random.default_rng(number).standard_normal(len(curve)) * 1e-9
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
    words = ["fit-map", str(path), "--radius", "5um", "--out", str(out), "--model", "jkr"]
    result = succeeded(app, [*words, "--plot", str(plot)])
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
    whole = out.read_text()
    lines = whole.splitlines(keepends=True)
    # What an interruption left: nothing, a part of the head or all of it, or two lines and half of the third.
    for left in ("", lines[0][:9], "".join(lines[:2]), "".join(lines[:4]) + lines[4][:20]):
        out.write_text(left)
        assert CliRunner().invoke(app, words).exit_code == 0
        assert out.read_text() == whole
    assert "the settings of" in CliRunner().invoke(app, [*words, "--model", "hertz"]).output
    # The relaxation of a known solid is held, and its Poisson's ratio is the default.
    solid = [*words[:4], "--out", str(tmp_path / "solid.csv"), "--model", "jkr", "--material", "polyurea"]
    assert CliRunner().invoke(app, solid).exit_code == 0
    assert '"material": "PronySeries(' in (tmp_path / "solid.csv").read_text().splitlines()[0]
    assert read_map(tmp_path / "solid.csv")[2]["relaxed_modulus"] == pytest.approx(rows[2]["relaxed_modulus"], rel=0.1)
    (tmp_path / "no.csv").write_text("a,b")
    assert "which is none" in CliRunner().invoke(app, [*words[:5], str(tmp_path / "no.csv")]).output


def test_a_map_of_text_files_has_a_line_for_one_that_is_no_curve(tmp_path):
    curve, setup, truth = closed_form("cone", 0, noise=0.005)
    (tmp_path / "none.csv").write_text("a,b\n1,2\n3,4\n")
    curve.with_sign("compression").write(tmp_path / "curve.csv")
    files, out = [str(tmp_path / name) for name in ("none.csv", "curve.csv")], tmp_path / "map.csv"
    shape = ["--model", "cone", "--half-angle", f"{setup.half_angle}"]
    words = ["fit-map", *files, "--radius", "10nm", "--out", str(out), "--force-sign", "compression", *shape]
    assert "1 without a fit: Expected a column force" in succeeded(app, words).output
    rows = read_map(out)
    assert [row["model"] for row in rows] == ["", "cone"]
    assert rows[1]["relaxed_modulus"] == pytest.approx(truth["relaxed_modulus"], rel=0.02)
