from io import StringIO
from pathlib import Path

import h5py
import pytest

from bem._support.progress import progress_bar
from bem._support.provenance import command_line
from bem.dataset.file import load_dataset
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import command
from tests.data_files import editing


def foreign(path, _):
    with h5py.File(path, "w") as file:
        file["x"] = 1


def of_version(version):
    def make(path, content):
        path.write_bytes(content)
        with editing(path) as file:
            file.attrs["format_version"] = version

    return make


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda *_: None, "data set file not found"),
        (lambda path, _: path.mkdir(), "received the folder"),
        (lambda path, _: path.write_text("not HDF5\n", encoding="utf-8"), "not HDF5"),
        (lambda path, content: path.write_bytes(content[:20_000]), "truncated or damaged"),
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
    content = path.read_bytes() if path.is_file() else b""
    for words in commands:
        result = command(*words)
        assert (result.exit_code, message in result.stderr, result.stderr.count("\n")) == (2, True, 1)
    assert not path.is_file() or path.read_bytes() == content
    result = command("merge", undisturbed, "--out", tmp_path / "c.txt")
    assert (result.exit_code, "Expected an output file called .h5 or .hdf5" in result.stderr) == (2, True)


@pytest.mark.parametrize(
    ("arguments", "message", "code"),
    [
        (["--out", "/proc/nowhere/data.h5"], "cannot write beside '/proc/nowhere/data.h5'", 1),
        (["--out", "."], "Expected an output file called .h5 or .hdf5", 2),
        (["--out", "c.txt", "--shard", "1/2"], "Expected an output file called .h5 or .hdf5; received c.txt", 2),
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


def test_design_file_and_options_together(tmp_path):
    path, out = tmp_path / "design.toml", tmp_path / "x.h5"
    path.write_text('design = "sobol"\ncount = 5\n[ranges]\ntabor = [1.0, 2.0]\n', encoding="utf-8")
    options = ("--count", "7", "--range", "dwell_time=1", "--accuracy", "1e-3")
    result = command("campaign", "--out", out, "--design-file", path, *options, solver=stand_in.solve)
    assert result.exit_code == 0, result.stderr
    found = load_dataset(out).attributes
    assert [found[name] for name in ("design", "count", "accuracy", "shard")] == ["sobol", 7, 1e-3, "1/1"]
    assert [found["ranges"][name] for name in ("tabor", "dwell_time")] == [[1.0, 2.0], [1.0, 1.0]]


def test_a_terminal_shows_what_is_done_and_what_failed(monkeypatch):
    shown = StringIO()
    monkeypatch.setattr(shown, "isatty", lambda: True)
    monkeypatch.setattr("sys.stderr", shown)
    with progress_bar(20, "differ") as show:
        show(3, 0)
        show(13, 2)
    assert "13/20\x1b[0m 2 differ, left: " in shown.getvalue()


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
