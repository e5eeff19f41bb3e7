from pathlib import Path

import h5py
import pytest

from bem._support.progress import rate_line
from bem._support.provenance import command_line
from bem.dataset.file import load_dataset
from tests.bem.dataset.campaign import stand_in
from tests.bem.dataset.campaign.helpers import command
from tests.data_files import editing


def bad_files(folder, undisturbed):
    (folder / "foreign.h5").write_text("not HDF5\n", encoding="utf-8")
    (folder / "truncated.h5").write_bytes(undisturbed.read_bytes()[:20_000])
    (folder / "older.h5").write_bytes(undisturbed.read_bytes())
    with editing(folder / "older.h5") as file:
        file.attrs["format_version"] = 0
    (folder / "worded.h5").write_bytes(undisturbed.read_bytes())
    with editing(folder / "worded.h5") as file:
        file.attrs["format_version"] = "1"
    with h5py.File(folder / "other.h5", "w") as file:
        file["x"] = 1


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("absent.h5", "data set file not found"),
        ("foreign.h5", "not HDF5"),
        ("truncated.h5", "truncated or damaged"),
        ("older.h5", "which is of version 0"),
        ("worded.h5", "which is of version '1'"),
        (".", "received the folder"),
        ("other.h5", "an HDF5 file of another kind"),
    ],
)
def test_files_that_are_no_data_sets(name, message, undisturbed, tmp_path):
    bad_files(tmp_path, undisturbed)
    result = command("verify", tmp_path / name)
    assert (result.exit_code, message in result.stderr, result.stderr.count("\n")) == (2, True, 1)
    if name in ("absent.h5", "."):
        return
    content = (tmp_path / name).read_bytes()
    for options in ([], ["--replace"] * (name != "truncated.h5")):
        result = command("campaign", "--count", "3", "--out", tmp_path / name, *options)
        assert (result.exit_code, message in result.stderr, result.stderr.count("\n")) == (2, True, 1)
        assert (tmp_path / name).read_bytes() == content
    result = command("merge", tmp_path / name, "--out", tmp_path / "merged.h5")
    assert (result.exit_code, message in result.stderr) == (2, True)


@pytest.mark.parametrize(
    ("arguments", "message", "code"),
    [
        ([], "campaign needs --out FILE.h5", 2),
        (["--out", "/proc/nowhere/data.h5"], "cannot write beside '/proc/nowhere/data.h5'", 1),
        (["--out", "."], "Expected an output file called .h5 or .hdf5", 2),
        (["--out", "c.txt"], "Expected an output file called .h5 or .hdf5; received c.txt", 2),
        (["--out", "c.txt", "--shard", "1/2"], "Expected an output file called .h5 or .hdf5; received c.txt", 2),
        (["--out", "x.h5", "--accuracy", 10**5 * "x"], "accuracy must be", 2),
        (["--out", "x.h5", "--count", "0"], "count must be a whole number from 1", 2),
        (["--out", "x.h5", "--count", "600000"], "count must be a whole number from 1 to 559872", 2),
        (["--out", "x.h5", "--design", "grid"], "design must be one of", 2),
        (["--out", "x.h5", "--range", "tabor=3:1"], "must have its lower bound first", 2),
        (["--out", "x.h5", "--range", "dwell_time=-1:1"], "lower bound of dwell_time must be", 2),
        (["--out", "x.h5", "--accuracy", "superb"], "accuracy", 2),
        (["--out", "x.h5", "--shard", "4/3"], "shard must be a whole number from 1 to 3", 2),
        (["--out", "x.h5", "--shard", "one"], "shard must read i/n", 2),
        (["--out", "x.h5", "--workers", "0"], "workers must be a whole number from 1", 2),
        (["--out", "loop.h5"], "out must not be a link in circles", 2),
        (["--out", "x.h5", "--workers", "-3"], "workers must be a whole number from 1", 2),
        (["--out", "x.h5", "--cluster", ""], "cluster must be an address like", 2),
        (["--out", "x.h5", "--cluster", "tcp://h:1", "--workers", "2"], "workers must not be given with cluster", 2),
        (["--out", "x.h5", "--range", "tabor=1:2", "--range", "tabor=2:3"], "received 'tabor' twice", 2),
        (["--out", "x.h5", "--shard", "4/5", "--count", "3"], "shards must be a whole number from 1 to 3", 2),
        (["--out", "x.h5", "--design-file", "."], "design file must be a file; received the folder", 2),
        (["--out", "x.h5", "--design-file", "absent.toml"], "design file not found", 2),
    ],
)
def test_bad_options_end_in_one_sentence(arguments, message, code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if "loop.h5" in arguments:
        Path("loop.h5").symlink_to("loop.h5")
    result = command("campaign", *arguments)
    assert (result.exit_code, message in result.stderr, result.stderr.count("\n")) == (code, True, 1), result.stderr
    assert len(result.stderr) < 1000
    assert [path.name for path in tmp_path.iterdir()] == ["loop.h5"] * ("loop.h5" in arguments)


@pytest.mark.parametrize("harm", [lambda content: content[:5000], lambda content: content[512:], lambda _: b""])
def test_a_damaged_file_is_replaced_where_asked(harm, undisturbed, tmp_path):
    out = tmp_path / "data.h5"
    out.write_bytes(harm(undisturbed.read_bytes()))
    result = command("campaign", "--out", out, "--count", "9")
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert "truncated or damaged, and may be replaced with --replace" in result.stderr
    result = command("campaign", "--out", out, "--count", "9", "--replace", solver=stand_in.solve)
    assert (result.exit_code, result.stderr) == (0, ""), result.stdout
    assert len(load_dataset(out)) == 9


def test_shards_are_merged_into_data_set_files_only(undisturbed, tmp_path):
    result = command("merge", undisturbed, "--out", tmp_path / "c.txt")
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert "Expected an output file called .h5 or .hdf5" in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_design_file_and_options_together(tmp_path, monkeypatch):
    called = []
    monkeypatch.setattr("bem.cli.campaign._run", lambda settings, _out, **rest: called.append((settings, rest)))
    path = tmp_path / "design.toml"
    path.write_text('design = "sobol"\ncount = 5\n[ranges]\ntabor = [1.0, 2.0]\n', encoding="utf-8")
    result = command(
        "campaign",
        "--out",
        "x.h5",
        "--design-file",
        path,
        "--count",
        "7",
        "--range",
        "dwell_time=1",
        "--accuracy",
        "1e-3",
    )
    assert result.exit_code == 0, result.stderr
    settings, rest = called[0]
    ranges = {"tabor": [1.0, 2.0], "dwell_time": (1.0, 1.0)}
    assert settings == {"design": "sobol", "count": 7, "accuracy": 1e-3, "ranges": ranges}
    assert rest["shard"] == (1, 1)


def test_rate_line():
    assert rate_line(10, 20, 0, 5.0) == "2.0 a second, none failed, 0:00:10 left"
    assert rate_line(0, 20, 3, 0.0) == "3 failed"


@pytest.mark.parametrize("count", ["inf", "nan", "1e400", '"12"', "100000000000000000000000", "true"])
def test_bad_counts_in_a_design_file_end_in_one_sentence(count, tmp_path):
    path = tmp_path / "design.toml"
    path.write_text(f"count = {count}\n", encoding="utf-8")
    result = command("campaign", "--out", tmp_path / "x.h5", "--design-file", path)
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert "count must be a whole number from 1 to 559872" in result.stderr


def test_failures_show_in_the_exit_status(tmp_path):
    out = tmp_path / "data.h5"
    options = ("campaign", "--count", 60, "--range", "tabor=3.1:3.2", "--out", out)
    for more in ((), (), ("--retry-failed",)):
        result = command(*options, *more, solver=stand_in.sometimes_fails)
        assert (result.exit_code, result.stderr) == (1, "")
        assert "60 failed: ArithmeticError: tabor is too large for me" in result.stdout
    result = command("merge", out, "--out", tmp_path / "merged.h5")
    assert result.exit_code == 1
    assert "60 failed" in result.stdout


def test_the_command_is_recorded_as_typed():
    assert command_line(["/somewhere/bin/bem", "campaign", "--out", "a b.h5"]) == "bem campaign --out 'a b.h5'"
    assert command_line(["/somewhere/bem/__main__.py", "merge"]) == "python -m bem merge"
