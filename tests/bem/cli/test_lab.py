"""The commands in SI units write what they promise, or one sentence and nothing."""

import dataclasses
import json

import numpy as np
import pytest
from typer.testing import CliRunner

from bem import PronySeries
from bem._support.command_line import run_command
from bem.cli.app import app
from bem.lab import ForceCurve
from tests.bem.lab.measurement import BEAD, TRUTH, closed_form, measured, write_map
from tests.processes import succeeded

CONTACT = {"radius": "50e-6", "work_of_adhesion": "0.05", "modulus": "2e6", "accuracy": "draft"}
CYCLE = {"peak_indentation": "3e-7", "loading_rate": "2e-6", "unloading_rate": "2e-6"}
SOLID = {"retardation_time": "0.1", "material": "sls:0.3"}


def options(named):
    """Words of options; one that is `None` is left out."""
    texts = {name.replace("_", "-"): str(value) for name, value in named.items() if value is not None}
    return [word for name, value in texts.items() for word in (f"--{name}", value)]


def simulated(*flags, command="simulate", **changes):
    return succeeded(app, [command, *flags, *options(CONTACT | CYCLE | SOLID | changes)])


def test_radius_gives_si_units_and_json(tmp_path):
    assert "effective" not in simulated().output
    result = simulated(csv=tmp_path / "a.csv", largest_tabor=3)
    assert "still attached at the end" in result.output
    assert "depends on the effective range" in result.output
    curve = ForceCurve.read(tmp_path / "a.csv")
    assert 5e-6 < curve.pull_off_force < 4e-5
    assert curve.indentation.max() == pytest.approx(3e-7)
    summary = json.loads(simulated("--json", largest_tabor=3).stdout)
    np.testing.assert_allclose(summary["force"], curve.force, rtol=1e-8)
    assert (summary["force_sign"], summary["detached"]) == ("tension", False)
    assert summary["pull_off_force"] == pytest.approx(curve.pull_off_force)
    units = {"radius": "50um", "work_of_adhesion": "50mJ/m2", "modulus": "2MPa", "peak_indentation": "300 nm"}
    units |= {"loading_rate": "2um/s", "retardation_time": "100ms", "csv": tmp_path / "a.csv", "largest_tabor": 3}
    assert simulated(command="simulate-si", **units).stdout == result.stdout


def test_material_is_an_entry_of_the_library():
    outputs = [
        simulated(retardation_time=None, material=material, modulus=modulus).stdout
        for modulus, material in (
            *(("2e6", "sylgard_184"), ("2e6", "elastic")),
            *((None, "sylgard_184"), ("2.05e6", "elastic")),  # its modulus is the default
        )
    ]
    assert (outputs[0], outputs[2]) == (outputs[1], outputs[3])
    cycle = {"peak_indentation": "2", "loading_rate": "10", "unloading_rate": "10"}
    succeeded(app, ["simulate", *options({"tabor": "0.5", "material": "sylgard_184_cured_at_100c"} | cycle)])


def test_a_fit_holds_a_known_prony_series(tmp_path):
    """The relaxation is the material's; modulus and adhesion are found."""
    series = BEAD.replaced(material=PronySeries([0.7], [0.1]), retardation_time=None)
    measured(series).shifted(contact_point=TRUTH["contact_point"]).write(tmp_path / "curve.csv")
    named = {"radius": "50um", "material": "prony:0.7@0.1", "model": "contact", "accuracy": "draft"}
    succeeded(app, ["fit", str(tmp_path / "curve.csv"), *options(named | {"out": tmp_path / "fit.json"})])
    values = json.loads((tmp_path / "fit.json").read_text())["values"]
    assert "retardation_time" not in values
    assert values["relaxed_modulus"] == pytest.approx(2e6, rel=0.03)
    assert values["work_of_adhesion"] == pytest.approx(0.05, rel=0.05)


def failed(arguments, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["bem", *arguments])
    with pytest.raises(SystemExit) as left:
        run_command(app, "bem")
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.startswith("bem: ")
    assert output.err.count("\n") == 1
    return left.value.code, output.err


OPTIONS = {
    "simulate": CONTACT | CYCLE | SOLID | {"csv": "a.csv"},
    "fit curve.csv": {"radius": "50e-6", "out": "fit.json", "plot": "fit.png"},
    "fit stage.csv": {"out": "fit.json"},
    "campaign": {"count": "3", "out": "-"},
    "merge a.h5": {"out": "-"},
}


@pytest.mark.parametrize(
    ("command", "changes", "message"),
    [
        ("simulate", {"radius": "-1"}, "radius must be a finite number greater than 0"),
        ("simulate", {"radius": "many"}, "radius must be a length, such as '50 um'; received 'many'"),
        ("simulate", {"unloading_rate": "-1e-6"}, "(in 300 pm and 100 ms)"),
        ("simulate", {"plot": "a.doc"}, "the output file must be called .png"),
        ("simulate", {"force_sign": "up"}, "--force-sign must be one of 'tension', 'compression'; received 'up'"),
        (
            *("simulate", dict.fromkeys(CYCLE) | {"times": "0,1", "forces": "1,1"}),
            "the simulation did not complete: not started: no contact bears the prescribed force",
        ),
        (
            "simulate",
            {"csv": "-"},
            "the output file must have a name, since standard output is for the summary; received -",
        ),
        ("campaign", {}, "the output file must be called .h5 or .hdf5; received -"),
        ("merge a.h5", {}, "the output file must be called .h5 or .hdf5; received -"),
        ("fit curve.csv", {}, "the approach shows no contact"),
        ("fit curve.csv", {"plot": "a.txt"}, "the output file must be called .png"),
        *(("fit curve.csv", {"out": name}, "the output file must be called .json") for name in ("a.txt", "-")),
        ("fit curve.csv", {"material": "rubber"}, "or an entry of the materials library"),
        (
            *("fit curve.csv", {"material": "sylgard_184", "retardation_time": "1s"}),
            "must not be given with sylgard_184_cured_at_100c, whose times are in seconds",
        ),
        (
            *("fit stage.csv", {"radius": "-1", "poisson_ratio": "2"}),
            "(stiffness, in N/m; --stiffness) must be given, to turn displacement into indentation; received none for "
            "stage.csv; --radius must be a finite number greater than 0; received -1.0; --poisson-ratio must be",
        ),
        ("fit curve.csv", {"range": "1um"}, "options must be those that --help lists; received --range"),
    ],
)
def test_mistake_writes_nothing(tmp_path, monkeypatch, capsys, command, changes, message):
    monkeypatch.chdir(tmp_path)
    time = np.linspace(0.0, 1.0, 60)
    noise = 1e-9 * np.random.default_rng(0).standard_normal(60)
    ForceCurve(time=time, indentation=np.minimum(time, 1.0 - time), force=noise).write("curve.csv")
    text = (tmp_path / "curve.csv").read_text().replace("indentation", "displacement")
    (tmp_path / "stage.csv").write_text(text)
    arguments = [*command.split(), *options(OPTIONS[command] | changes)]
    code, error = failed(arguments, monkeypatch, capsys)
    assert code == (1 if "did not complete" in message else 2)
    assert message in error
    assert {path.name for path in tmp_path.iterdir()} == {"curve.csv", "stage.csv"}


def test_fit_writes_its_json_and_its_picture(tmp_path):
    curve, setup, truth = closed_form("jkr", 3)
    curve.write(tmp_path / "curve.csv")
    named = {"radius": setup.radius, "modulus": truth["relaxed_modulus"], "model": "jkr"} | SOLID
    named |= {"free": "work_of_adhesion,contact_point,force_offset,tilt,drag"}
    named |= {"out": tmp_path / "fit.json", "plot": tmp_path / "fit.png"}
    result = succeeded(app, ["fit", str(tmp_path / "curve.csv"), *options(named)])
    fitted = json.loads((tmp_path / "fit.json").read_text())
    assert fitted["values"]["work_of_adhesion"] == pytest.approx(truth["work_of_adhesion"], rel=0.05)
    assert f"{1e3 * fitted['values']['work_of_adhesion']:.4g} mJ/m^2" in result.output
    assert (tmp_path / "fit.png").stat().st_size > 1000


def test_a_stiffness_moves_the_stage(tmp_path):
    result = simulated(csv=tmp_path / "a.csv", stiffness="50", material="elastic")
    assert result.stderr == "bem: an elastic solid does not relax: --retardation-time needs a --material like sls:0.3\n"
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
    assert "--times and --forces must be given together" in str(refused.exception)


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


def test_file_of_curves_is_never_one_curve(tmp_path, monkeypatch, capsys):
    path = afm_map(tmp_path / "map.h5")
    arguments = ["fit", str(path), "--radius", "5um", "--force-sign", "compression"]
    code, error = failed(arguments, monkeypatch, capsys)
    assert code == 2
    assert "the number of a curve must be given, from 0 to 2" in error
    assert "from 0 to 2; received 7" in failed([*arguments, "--number", "7"], monkeypatch, capsys)[1]
    result = succeeded(app, [*arguments, "--number", "2", "--model", "jkr", "--segment", "retract"])
    assert "JKR: elastic sphere" in result.output
