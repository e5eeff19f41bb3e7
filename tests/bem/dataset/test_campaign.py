"""A campaign from its command to its file, which is what the documentation says."""

import re
from io import StringIO
from pathlib import Path

import h5py
import numpy as np
import pytest

from bem import Cases
from bem._support.command_line import progress_bar
from bem._support.provenance import command_line
from bem.cli.arguments import read_design_file
from bem.dataset.campaign import Campaign
from bem.dataset.designs import Design
from bem.dataset.file import load_dataset, open_dataset
from bem.dataset.measurement_steps import measurement_grid
from bem.dataset.records import NATIVE_QUANTITIES
from bem.dataset.run import run_campaign
from bem.dataset.sealed_file import arrays
from bem.dataset.solids import Solids
from surrogate.data.dataset import TrajectoryDataset
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import assert_same_numbers, command, run_here
from tests.data_files import editing
from tests.processes import ROOT


def test_file_is_as_documented(plan, undisturbed):
    dataset = load_dataset(undisturbed)
    learned = TrajectoryDataset.load(undisturbed)
    assert len(dataset) == len(learned.completed) == 120
    assert dataset.counts == learned.points_per_phase == (50, 20, 50)
    for name, values in plan.protocols.items():
        np.testing.assert_array_equal(dataset.protocols[name], values)
    attributes = dataset.attributes
    assert (attributes["design"], attributes["seed"], attributes["accuracy"]) == ("paper", 4, "standard")
    assert attributes["ranges"]["tabor"] == [0.2, 3.2]
    assert attributes["command"] == "bem campaign --count 120"
    assert {"python", "numpy", "scipy", "numba"} <= attributes["versions"].keys()
    assert attributes["host"]
    assert attributes["git_revision"]
    assert attributes["core_seconds"] > 0.0
    assert 5e7 < attributes["peak_memory"] < 1e11
    jumps = dataset.columns["jumps/trajectory"]
    np.testing.assert_array_equal(np.unique(jumps), np.flatnonzero(plan.protocols["tabor"] > 1.0))
    np.testing.assert_array_equal(dataset.scalars["jump_count"], np.bincount(jumps, minlength=120))


def test_histories_are_the_solvers_own(plan, undisturbed):
    times, rows = measurement_grid(**plan.protocols)[0], np.array([0, 57, 119])
    with open_dataset(undisturbed) as file:
        for row, case in zip(rows, plan.cases_of(rows), strict=True):
            piece, trajectory = slice(*file["native/offsets"][row : row + 2]), stand_in.solve(*case)
            for name in NATIVE_QUANTITIES:
                np.testing.assert_array_equal(file[f"native/{name}"][piece], getattr(trajectory, name))
            np.testing.assert_array_equal(file["fms/force"][row], trajectory.at(times[row]).astype(np.float32))
            assert file["scalars/pull_off_force"][row] == trajectory.pull_off_force


def test_failures_are_recorded_with_reasons(out, tmp_path):
    tabor = Campaign(count=200, seed=1).protocols["tabor"]
    deep, shallow = np.sum(tabor > 3.0), np.sum(tabor < 0.25)
    arguments = ("campaign", "--count", 200, "--seed", 1, "--out", out)
    for call in (arguments, arguments, (*arguments, "--retry-failed"), ("merge", out, "--out", tmp_path / "merged.h5")):
        result = command(*call, solver=stand_in.sometimes_fails)
        assert (result.exit_code, result.stderr) == (1, "")
        assert f", {deep + shallow} failed" in result.stdout
        assert f"{deep} failed: ArithmeticError: tabor is too large for me\n" in result.stdout
        assert f"{shallow} failed: no stable equilibrium found\n" in result.stdout
    dataset = load_dataset(out)
    np.testing.assert_array_equal(dataset.completed, np.flatnonzero((tabor <= 3.0) & (tabor >= 0.25)))
    lost = dataset.columns["status"] == 1
    assert np.isnan(dataset.force[lost]).all()
    assert np.isnan(dataset.scalars["pull_off_force"][lost]).all()


def test_the_same_command_again_only_reads(plan, undisturbed, monkeypatch):
    def refused(*_):
        raise ValueError("the output file must be a place that can be written")

    data, seen = undisturbed.read_bytes(), []
    monkeypatch.setattr("bem.dataset.run.require_output", refused)
    assert run_campaign(plan, undisturbed, solver=stand_in.solve, progress=lambda *of: seen.append(of)).computed == 0
    assert undisturbed.read_bytes() == data
    assert seen == [(120, 0)]
    with pytest.raises(ValueError, match="can be written"):
        run_campaign(plan, undisturbed.with_name("other.h5"), solver=stand_in.solve)


@pytest.mark.usefixtures("in_this_process")
def test_other_campaign_does_not_overwrite(undisturbed, tmp_path):
    plan = Campaign(count=120, seed=5, design=Design("sobol"))
    data = undisturbed.read_bytes()
    copy = tmp_path / "data.h5"
    copy.write_bytes(data)
    with pytest.raises(ValueError, match="design 'paper' there and 'sobol' here, seed 4 there and 5 here, native True"):
        run_campaign(plan, copy, solver=stand_in.solve)
    with pytest.raises(ValueError, match="made by another version of the solver"):
        run_campaign(Campaign(count=120, seed=4, native=True), copy, solver=stand_in.slow)
    assert copy.read_bytes() == data
    assert run_campaign(plan, copy, solver=stand_in.solve, replace=True).computed == 120
    run_campaign(plan, tmp_path / "fresh.h5", solver=stand_in.solve)
    assert_same_numbers(copy, tmp_path / "fresh.h5")


@pytest.mark.usefixtures("in_this_process")
def test_link_stays_and_target_is_written(tmp_path):
    (tmp_path / "there").mkdir()
    link = tmp_path / "data.h5"
    link.symlink_to(tmp_path / "there" / "real.h5")
    run_campaign(Campaign(count=10), link, solver=stand_in.solve, workers=1)
    assert link.is_symlink()
    assert len(load_dataset(tmp_path / "there" / "real.h5")) == 10
    link.unlink()
    link.symlink_to(link)
    with pytest.raises(ValueError, match="the output file must be a place that can be written"):
        run_campaign(Campaign(count=10), link, solver=stand_in.solve, workers=1)


def foreign(path, _):
    with h5py.File(path, "w") as file:
        file["x"] = 1


def of_version(version):
    def make(path, data):
        path.write_bytes(data)
        with editing(path) as file:
            file.attrs["format_version"] = version

    return make


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda *_: None, "data set file not found"),
        (lambda path, _: path.mkdir(), "received the folder"),
        (lambda path, _: path.write_text("not HDF5\n", encoding="utf-8"), "not HDF5"),
        (lambda path, data: path.write_bytes(data[:20_000]), "truncated or damaged"),
        (of_version(0), "which is of version 0"),
        (of_version("1"), "which is of version '1'"),
        (foreign, "an HDF5 file of another kind"),
    ],
)
def test_files_that_are_no_data_sets(make, message, undisturbed, tmp_path):
    path = tmp_path / "some.h5"
    make(path, undisturbed.read_bytes())
    commands = [("verify", path), ("merge", path, "--out", tmp_path / "merged.h5")]
    if path.is_file():
        commands.append(("campaign", "--count", "3", "--out", path))
        commands += [(*commands[-1], "--replace")] * ("truncated" not in message)
    data = path.read_bytes() if path.is_file() else b""
    for arguments in commands:
        result = command(*arguments)
        assert (result.exit_code, message in result.stderr, result.stderr.count("\n")) == (2, True, 1)
    assert not path.is_file() or path.read_bytes() == data
    result = command("merge", undisturbed, "--out", tmp_path / "c.txt")
    assert (result.exit_code, "the output file must be called .h5 or .hdf5" in result.stderr) == (2, True)


@pytest.mark.parametrize(
    ("arguments", "message", "code"),
    [
        (["--out", "/proc/nowhere/data.h5"], "cannot write beside '/proc/nowhere/data.h5'", 1),
        (["--out", "."], "the output file must be called .h5 or .hdf5", 2),
        (["--out", "c.txt", "--shard", "1/2"], "the output file must be called .h5 or .hdf5; received c.txt", 2),
        (["--out", "loop.h5"], "Too many levels of symbolic links", 2),
        (["--out", "x.h5", "--accuracy", 10**5 * "x"], "accuracy must be", 2),
        (["--out", "x.h5", "--range", "tabor=1:2", "--range", "tabor=2:3"], "received 'tabor' twice", 2),
        (["--out", "x.h5", "--shard", "one"], "shard must read i/n", 2),
        (["--out", "x.h5", "--workers", "0"], "workers must be a whole number from 1", 2),
        (["--out", "x.h5", "--cluster", ""], "cluster must be an address like", 2),
        (["--out", "x.h5", "--cluster", "tcp://h:1", "--workers", "2"], "workers must not be given with cluster", 2),
        (["--out", "x.h5", "--design-file", "."], "design file must be a file; received the folder", 2),
        (["--out", "x.h5", "--design-file", "absent.toml"], "design file not found", 2),
        (["--out", "x.h5", "--design-file", "text.toml"], "count must be a whole number from 1 to 559872", 2),
        (["--out", "x.h5", "--design-file", "broken.toml"], "design file must be TOML; received 'broken.toml'", 2),
        (["--out", "x.h5", "--design-file", "other.toml"], "received 'speed' in 'other.toml'", 2),
        (["--out", "x.h5", "--design-file", "ranges.toml"], "ranges must be a table of NAME = [LOW, HIGH]", 2),
    ],
)
def test_bad_options_end_in_one_sentence(arguments, message, code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    texts = {"text": 'count = "12"', "broken": "design =", "other": "speed = 1", "ranges": "ranges = 3"}
    for name, text in texts.items():
        Path(f"{name}.toml").write_text(text, encoding="utf-8")
    Path("loop.h5").symlink_to("loop.h5")
    result = command("campaign", *arguments)
    assert (result.exit_code, message in result.stderr, result.stderr.count("\n")) == (code, True, 1), result.stderr
    assert len(result.stderr) < 1000
    assert {path.name for path in tmp_path.iterdir()} == {"loop.h5", *(f"{name}.toml" for name in texts)}


@pytest.mark.parametrize("harm", [lambda data: data[:5000], lambda _: b""])
def test_damaged_file_is_replaced_on_request(harm, undisturbed, out):
    out.write_bytes(harm(undisturbed.read_bytes()))
    result = command("campaign", "--out", out, "--count", "9")
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert "truncated or damaged, and may be replaced with --replace" in result.stderr
    result = command("campaign", "--out", out, "--count", "9", "--replace", solver=stand_in.solve)
    assert (result.exit_code, result.stderr) == (0, ""), result.stdout
    assert len(load_dataset(out)) == 9


def test_design_file_and_options_together(tmp_path):
    path, out = tmp_path / "design.toml", tmp_path / "x.h5"
    path.write_text('design = "sobol"\ncount = 5\n[ranges]\ntabor = [1.0, 2.0]\n', encoding="utf-8")
    options = ("--count", "7", "--range", "dwell_time=1", "--accuracy", "1e-3")
    result = command("campaign", "--out", out, "--design-file", path, *options, solver=stand_in.solve)
    assert result.exit_code == 0, result.stderr
    attributes = load_dataset(out).attributes
    assert [attributes[name] for name in ("design", "count", "accuracy", "shard")] == ["sobol", 7, 1e-3, "1/1"]
    assert [attributes["ranges"][name] for name in ("tabor", "dwell_time")] == [[1.0, 2.0], [1.0, 1.0]]


def test_terminal_shows_done_and_failed(monkeypatch):
    shown = StringIO()
    monkeypatch.setattr(shown, "isatty", lambda: True)
    monkeypatch.setattr("sys.stderr", shown)
    with progress_bar(20, "differ") as show:
        show(3, 0)
        show(13, 2)
    assert "13/20\x1b[0m 2 differ, left: " in shown.getvalue()


def test_the_command_is_recorded_as_typed():
    assert command_line(["/somewhere/bin/bem", "campaign", "--out", "a b.h5"]) == "bem campaign --out 'a b.h5'"
    assert command_line(["/somewhere/bem/__main__.py", "merge"]) == "python -m bem merge"


TEXT, CASES = ((ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8") for name in ("dataset", "cluster"))
PLAN = Campaign(design=Design("log-uniform", solids=Solids()), count=40, native=True)


@pytest.mark.parametrize(
    ("text", "job", "attributes"),
    [
        (TEXT, PLAN, r"(?s)\| Attribute \|.*?The group `/fms`"),
        (CASES, Cases(PLAN.cases_of(PLAN.indices)), r"(?s)Attributes of the root.*?\n\n"),
    ],
)
def test_the_documented_tree_is_the_files(text, job, attributes, tmp_path):
    table = re.search(attributes, text)[0]
    if table.startswith("| Attribute"):
        table = "".join(line.split("|")[1] for line in table.splitlines() if line.startswith("| `"))
    with h5py.File(run_here(job, tmp_path / "file.h5", solver=stand_in.solve).path) as file:
        sizes = {"n": 40, "n + 1": 41, "N": 120, "terms": 4, "m": int(file["native/offsets"][-1])}
        sizes["j"] = len(file["jumps/trajectory"]) if "jumps" in file else 0
        stored = {
            (name, "string" if h5py.check_string_dtype(item.dtype) else item.dtype.name, item.shape)
            for name, item in arrays(file)
        }
        assert set(re.findall(r"`([a-z_]+)`", table)) == set(file.attrs)
        assert "fms" not in file or file["fms"].attrs["counts"].tolist() == [50, 20, 50]
    rows = re.findall(r"^\| `/([a-z_/]+)` \| (\w+) \| \(([^|]*?),?\) \|", text, re.MULTILINE)
    assert {(name, dtype, tuple(sizes[size] for size in shape.split(", "))) for name, dtype, shape in rows} == stored


def test_the_documented_design_file_is_read(tmp_path):
    (tmp_path / "design.toml").write_text(TEXT[TEXT.index("```toml\n") + 8 :].split("```")[0], encoding="utf-8")
    assert read_design_file(tmp_path / "design.toml")["ranges"] == {"tabor": [1.0, 3.2]}
