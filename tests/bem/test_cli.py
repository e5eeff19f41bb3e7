import json
import subprocess
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

from bem.cli import app, parse_material
from bem.materials import Elastic, PronySeries, StandardLinearSolid

CASE = {
    "tabor": "0.5",
    "peak-indentation": "2",
    "loading-rate": "10",
    "dwell-time": "0.1",
    "unloading-rate": "10",
    "accuracy": "draft",
}


def command(*extra, **changes):
    options = CASE | {name.replace("_", "-"): value for name, value in changes.items()}
    return ["simulate", *(word for name, value in options.items() for word in (f"--{name}", value)), *extra]


def invoke(*extra, **changes):
    return CliRunner().invoke(app, command(*extra, **changes))


def test_the_summary_is_short_and_readable():
    result = invoke()
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    assert lines[0].split() == ["status", "completed"]
    assert [line.split("  ")[0] for line in lines[1:5]] == [
        "pull-off force",
        "max compression",
        "hysteresis",
        "end force",
    ]
    assert lines[-1].startswith("cost ")


def test_json_holds_the_summary_and_the_arrays():
    result = invoke("--json")
    assert result.exit_code == 0
    data = json.loads(result.stdout)
    assert data["status"] == "completed"
    assert len(data["time"]) == len(data["force"]) == len(data["indentation"]) == len(data["contact_radius"])
    assert data["pull_off_force"] == pytest.approx(max(data["force"]))
    assert data["stats"]["memory_vectors"] == 1


def test_csv_and_plot_are_written(tmp_path):
    table, picture = tmp_path / "force.csv", tmp_path / "loop.png"
    result = invoke("--csv", str(table), "--plot", str(picture), "--json")
    assert result.exit_code == 0
    assert table.read_text().splitlines()[0] == "time,indentation,force,contact_radius"
    data = json.loads(result.stdout)
    np.testing.assert_allclose(np.loadtxt(table, delimiter=",", skiprows=1)[:, 2], data["force"], rtol=1e-8)
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_jumps_are_told():
    result = invoke(tabor="3", material="elastic", peak_indentation="1", accuracy="standard")
    assert result.exit_code == 0
    assert sum(line.startswith("jump ") for line in result.stdout.splitlines()) == 2


def test_a_simulation_that_cannot_start_writes_all_it_was_asked_for_but_the_picture(tmp_path):
    table, picture = tmp_path / "force.csv", tmp_path / "loop.png"
    picture.write_bytes(b"of an earlier run")
    result = invoke("--json", "--csv", str(table), "--plot", str(picture), tabor="50", peak_indentation="100")
    assert result.exit_code == 1
    assert json.loads(result.stdout)["status"].startswith("not started: ")
    assert "there is nothing to draw" in result.stderr
    assert table.read_text().splitlines() == ["time,indentation,force,contact_radius"]
    assert picture.read_bytes() == b"of an earlier run"
    assert sorted(tmp_path.iterdir()) == [table, picture]


def test_an_unfinished_simulation_prints_its_status_and_exits_with_1():
    result = invoke("--json", tabor="50", peak_indentation="100")
    assert result.exit_code == 1
    data = json.loads(result.stdout)
    assert data["status"].startswith("not started: ")
    assert data["pull_off_force"] is None
    assert data["force"] == []


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
    "changes",
    [
        {"tabor": "-1"},
        {"loading_rate": "0"},
        {"unloading_rate": "nan"},
        {"dwell_time": "-1"},
        {"material": "sls:2"},
        {"material": "honey"},
        {"material": "prony:0.3"},
        {"material": "elastic:3"},
        {"accuracy": "perfect"},
        {"adhesion": "glue"},
        {"initial_state": "wet"},
        {"csv": "/nowhere/at/all/force.csv"},
        {"plot": "loop"},
    ],
    ids=lambda changes: " ".join(changes) + " " + " ".join(changes.values()),
)
def test_a_mistake_is_one_sentence_with_what_was_received(changes):
    result = invoke(**changes)
    assert isinstance(result.exception, ValueError)
    assert "; received " in str(result.exception)
    assert "\n" not in str(result.exception)


def test_on_the_command_line_a_mistake_exits_with_2_and_without_a_traceback():
    result = subprocess.run(
        [sys.executable, "-m", "bem", *command(tabor="-1")], capture_output=True, text=True, timeout=120
    )
    assert result.returncode == 2
    assert result.stdout == ""
    assert result.stderr.startswith("bem: tabor must be a finite number at least 1e-06")
    assert result.stderr.count("\n") == 1
    assert "Traceback" not in result.stderr
