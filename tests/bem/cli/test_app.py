import json
import re
from typing import get_args

import numpy as np
import pytest
from typer.testing import CliRunner

from bem import ForceProtocol, LoadingProtocol, PiecewiseLinearProtocol, Scene, simulate
from bem._support.command_line import FIRST_PROTOCOL
from bem.cli.app import app, readable
from bem.cli.arguments import Adhesion, parse_material
from bem.materials_library.entries import FOLDER
from bem.problem.materials import Elastic, PronySeries, StandardLinearSolid
from bem.problem.tractions import LAWS
from bem.results.plots import draw_trajectory, title_of
from experiments.paper_numbers import paper_rows
from tests.bem.results.test_trajectory import trajectory_of
from tests.processes import succeeded

KINDS = (ForceProtocol, PiecewiseLinearProtocol)
CASE = {"tabor": "0.5", "peak-indentation": "2", "loading-rate": "10", "dwell-time": "0.1", "unloading-rate": "10"}


def command(*extra, **changes):
    options = CASE | {"accuracy": "draft"} | {name.replace("_", "-"): value for name, value in changes.items()}
    return ["simulate", *(word for name, value in options.items() for word in (f"--{name}", value)), *extra]


def invoke(*extra, **changes):
    return CliRunner().invoke(app, command(*extra, **changes))


def test_the_summary_is_a_table_with_units():
    lines = succeeded(app, command()).stdout.splitlines()
    assert lines[0] == "Tabor parameter 0.5, standard linear solid of modulus ratio 0.1"
    rows = [re.split(" {2,}", line) for line in lines[lines.index("") + 1 : -2]]
    assert rows[0] == ["quantity (tension positive)", "value", "unit"]
    assert {name: unit for name, _, unit in rows[1:]} == {
        **dict.fromkeys(("pull-off force", "largest compression", "end force"), "pi R dgamma"),
        "pull-off time": "retardation time",
        "hysteresis": "h0 pi R dgamma",
    }
    assert lines[-1].startswith("cost: ")


def test_default_is_the_first_sample():
    sample = paper_rows("canonical_protocols")[0]
    scene, protocol = (
        Scene(1.0, StandardLinearSolid(0.1)),
        LoadingProtocol(**{key: sample[key] for key in FIRST_PROTOCOL}),
    )
    data = json.loads(succeeded(app, ["simulate", "--json"]).stdout)
    assert data["pull_off_force"] == simulate(scene, protocol).pull_off_force
    longer = json.loads(succeeded(app, ["simulate", "--json", "--dwell-time", "2"]).stdout)
    assert longer["time"][-1] == pytest.approx(data["time"][-1] + 1.0)


def test_terminal_gets_a_named_picture(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "contact.png").write_bytes(b"of the user")
    assert "Written" not in succeeded(app, command()).stdout
    assert list(tmp_path.iterdir()) == [tmp_path / "contact.png"]
    monkeypatch.setattr("typer.testing._NamedTextIOWrapper.isatty", lambda _: True, raising=False)
    assert succeeded(app, command()).stdout.endswith("Written: contact-2.png\n")
    assert (tmp_path / "contact-2.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "contact.png").read_bytes() == b"of the user"
    for options in (["--json"], ["--csv", "a.csv"]):
        succeeded(app, command(*options))
    assert {path.name for path in tmp_path.iterdir()} == {"contact.png", "contact-2.png", "a.csv"}


@pytest.mark.parametrize(
    ("changes", "beginning", "count"),
    [
        ({"adhesion": "none"}, "pull-off force                none", 1),
        ({"tabor": "3", "material": "elastic", "peak_indentation": "1", "accuracy": "standard"}, "jump ", 2),
        (
            {"tabor": "3.2", "peak_indentation": "10", "dwell_time": "1"},
            "still attached at the end: the pull-off force is the largest so far",
            1,
        ),
    ],
)
def test_the_summary_tells_what_is_special(changes, beginning, count):
    lines = succeeded(app, command(**changes)).stdout.splitlines()
    assert sum(line.startswith(beginning) for line in lines) == count


def test_json_csv_and_plot_are_written(tmp_path):
    table, picture = tmp_path / "force.csv", tmp_path / "loop.png"
    data = json.loads(succeeded(app, command("--csv", str(table), "--plot", str(picture), "--json")).stdout)
    assert data["status"] == "completed"
    assert len(data["time"]) == len(data["force"]) == len(data["indentation"]) == len(data["contact_radius"])
    assert data["pull_off_force"] == pytest.approx(max(data["force"]))
    assert data["stats"]["memory_vectors"] == 1
    assert "stage" not in data
    assert table.read_text().splitlines()[0] == "time,indentation,force,contact_radius"
    np.testing.assert_allclose(np.loadtxt(table, delimiter=",", skiprows=1)[:, 2], data["force"], rtol=1e-8)
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_negative_work_is_no_dissipation():
    def work_line(force):
        loop = trajectory_of(range(3), [2.0, 1.0, 0.0], force, unloading=[False, True, True])
        return [line for line in readable(loop).splitlines() if line.startswith("work")]

    sentence = "work -10 h0 pi R dgamma: the contact gave energy back; not dissipation"
    assert work_line(np.full(3, -5.0)) == [sentence]
    assert work_line(np.full(3, 5.0)) == work_line(np.array([5.0, 0.0, -5.005])) == []


def test_unstarted_simulation_draws_nothing(tmp_path):
    table, picture = tmp_path / "force.csv", tmp_path / "loop.png"
    picture.write_bytes(b"of an earlier run")
    files = "--csv", str(table), "--plot", str(picture), "--filmstrip", str(tmp_path / "film.png")
    result = invoke("--json", *files, tabor="5000", peak_indentation="100")
    assert result.exit_code == 1
    data = json.loads(result.stdout)
    assert data["status"].startswith("not started: ")
    assert data["pull_off_force"] is None
    assert data["force"] == []
    assert "there is nothing to draw" in result.stderr
    assert table.read_text().splitlines() == ["time,indentation,force,contact_radius"]
    assert picture.read_bytes() == b"of an earlier run"
    assert sorted(tmp_path.iterdir()) == [table, picture]


@pytest.mark.parametrize(
    ("text", "material"),
    [
        ("elastic", Elastic()),
        ("sls:0.01", StandardLinearSolid(modulus_ratio=0.01)),
        ("prony:0.3@0.1,0.4@10", PronySeries([0.3, 0.4], [0.1, 10.0])),
    ],
)
def test_materials_have_words(text, material):
    assert parse_material(text) == material


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (command(material="sls:2"), "modulus_ratio must be"),
        *((command(material=word), "material must be elastic, sls:K") for word in ("honey", "prony:0.3", "elastic:3")),
        (command(tabor="-1"), "tabor must be"),
        (command(tabor="0.2", peak_indentation="-1"), "; received"),
        (command(accuracy="perfect"), "accuracy must be"),
        (command(csv="/nowhere/at/all/force.csv"), "the output file must lie in a directory that exists; received"),
        (command(csv="-"), "the output file must have a name, since standard output is for the summary; received -"),
        *((command(plot=name), "the output file must be called .png") for name in ("loop", "-")),
        (["--times", "0,1"], "--times and --forces must be given together; received --times alone"),
        (["--times", "0,1", "--forces", "0,1", "--loading-rate", "1"], "received --loading-rate and --forces"),
        (["--times", "0,x", "--forces", "0,1"], "times must be numbers separated by commas; received '0,x'"),
        (["--loading-rate", "1"], "--peak-indentation, --unloading-rate must be given, or --times and --forces"),
    ],
)
def test_mistake_sentence_has_the_value(arguments, message):
    result = CliRunner().invoke(
        app, arguments if arguments[0] == "simulate" else ["simulate", "--tabor", "1", *arguments]
    )
    assert isinstance(result.exception, ValueError)
    assert message in str(result.exception)
    assert "; received " in str(result.exception)
    assert "\n" not in str(result.exception)


def test_spring_column_and_jumps(tmp_path):
    path = tmp_path / "a.csv"
    changes = {"tabor": "1", "material": "elastic", "start_indentation": "-9", "loading_rate": "1"}
    result = succeeded(app, command(**changes, spring="0.5", csv=str(path)))
    table = np.genfromtxt(path, delimiter=",", names=True)
    np.testing.assert_allclose(table["stage"], table["indentation"] - table["force"] / 0.5, atol=1e-7)
    jump = next(line for line in result.output.splitlines() if line.startswith("jump"))
    assert " -> " in jump.partition(":")[0]
    assert "stage" in json.loads(invoke("--json", **changes, spring="0.5").output)


def test_force_protocol_on_the_command_line(tmp_path):
    arguments = ["simulate", "--tabor", "1", "--material", "elastic", "--times", "0,1,2", "--forces", "0,-5,3"]
    result = succeeded(app, [*arguments, "--plot", str(tmp_path / "a.png")])
    assert "detached: no contact bears the prescribed force" in result.output
    assert "-> flown off" in result.output
    assert (tmp_path / "a.png").is_file()


def test_help_begins_with_a_simulation():
    text = CliRunner().invoke(app, ["--help"]).stdout
    assert "--show-completion" in text
    assert text.index("simulate ") < text.index("fit ") < text.index("campaign ")
    assert "--radius" in CliRunner().invoke(app, ["simulate", "--help"]).stdout


def test_picture_title_names_the_solid():
    rates = {"loading_rate": 1234.56, "unloading_rate": 1234.56}
    cycle = LoadingProtocol(peak_indentation=123.456, dwell_time=0.00123456, **rates)
    solids = [Elastic(), StandardLinearSolid(0.1), PronySeries([0.5], [1.0])]
    names = [title_of(Scene(1.0, solid), cycle).splitlines()[0].split(", ")[1] for solid in solids]
    ratios = [f" of modulus ratio {ratio}" for ratio in (0.1, 0.5)]
    assert names == ["elastic", f"standard linear solid{ratios[0]}", f"Prony series{ratios[1]}"]
    trajectory = trajectory_of(range(3), [2.0, 1.0, 0.0], np.ones(3), unloading=[False, True, True])
    few, many = [-1.0, -5.0, 1.0], [0.123456789e-3 * number for number in range(400)]
    for protocol in (cycle, *(make(range(len(path)), path) for make in KINDS for path in (few, many))):
        picture = draw_trajectory(trajectory, title_of(Scene(1.23456, StandardLinearSolid(0.123456)), protocol))
        picture.draw_without_rendering()
        across = picture._suptitle.get_window_extent()
        assert 0.0 < across.x0 < across.x1 < picture.bbox.width


def test_choices_of_adhesion_are_all_laws():
    assert set(get_args(get_args(Adhesion)[0])) == LAWS.keys()


def test_material_of_a_file(tmp_path):
    own = tmp_path / "my rubber.toml"
    own.write_bytes((FOLDER / "polyurea_at_0c.toml").read_bytes())
    assert parse_material(str(own)) == parse_material("polyurea_at_0c")
