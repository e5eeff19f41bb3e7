import errno
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from bem._support.outputs import Outputs, require_output, whole_file, write_whole

UNWRITABLE = "the output file must be a place that can be written; received "


def listing(folder):
    return {path.name: path.read_text() for path in folder.iterdir()}


def test_a_file_is_whole_or_not_there(tmp_path):
    def fail(path):
        with whole_file(path) as temporary:
            temporary.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail(tmp_path / "out.csv")
    assert list(tmp_path.iterdir()) == []
    with whole_file(tmp_path / "out.csv") as temporary:
        assert temporary.suffix == ".csv"
        temporary.write_text("whole")
    assert listing(tmp_path) == {"out.csv": "whole"}


def write_both(first, second, texts=("one", "two")):
    with Outputs(first, None, second) as outputs:
        for path, text in zip((first, second), texts, strict=True):
            with outputs.write(path) as temporary:
                temporary.write_text(text)


def test_several_files_appear_together(tmp_path, monkeypatch):
    first, second = tmp_path / "a.csv", tmp_path / "b.png"
    write_both(first, second)
    assert listing(tmp_path) == {"a.csv": "one", "b.png": "two"}
    write_both(first, second, ("three", "four"))
    assert listing(tmp_path) == {"a.csv": "three", "b.png": "four"}

    # The second refuses to take its place after the first has.
    replace = Path.replace

    def refuse(self, target):
        if Path(target) == second and ".former" not in self.name:
            raise PermissionError(errno.EACCES, "Permission denied", str(self))
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", refuse)
    with pytest.raises(ValueError, match=r"written; received .*b\.png \(Permission denied\)"):
        write_both(first, second, ("five", "six"))
    assert listing(tmp_path) == {"a.csv": "three", "b.png": "four"}
    with pytest.raises(ValueError, match="Permission denied"), whole_file(second) as temporary:
        temporary.write_text("seven")
    first.unlink()
    with pytest.raises(ValueError, match="Permission denied"):
        write_both(first, second, ("five", "six"))
    assert listing(tmp_path) == {"b.png": "four"}


def test_places_that_cannot_be_written(tmp_path):
    for path in (tmp_path / f"{'n' * 300}.csv", Path("/proc/self/out.csv")):
        with pytest.raises(ValueError, match=UNWRITABLE) as caught:
            require_output(path)
        assert str(path) in str(caught.value)
        with pytest.raises(ValueError, match=UNWRITABLE), Outputs(tmp_path / "a.csv", path):
            pass
    for path in (tmp_path, tmp_path / "none" / "a.csv"):
        with pytest.raises(ValueError, match="a directory that exists; received"):
            require_output(path)
    with pytest.raises(ValueError, match="which is a directory itself"):
        require_output(tmp_path)
    with pytest.raises(ValueError, match="the output files must be different"):
        Outputs(tmp_path / "a.csv", tmp_path / "a.csv")
    for paths in ((Path("-"),), (Path("-"), tmp_path / "a.csv")):
        with pytest.raises(ValueError, match=r"^the output file must have a name, .*; received -$"):
            Outputs(*paths)
    require_output(tmp_path / f"{'n' * 250}.csv")
    assert list(tmp_path.iterdir()) == []


def test_links_and_devices_stay(tmp_path):
    (tmp_path / "target.csv").write_text("old")
    (tmp_path / "link.csv").symlink_to(tmp_path / "target.csv")
    with whole_file(tmp_path / "link.csv") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "link.csv").is_symlink()
    assert (tmp_path / "target.csv").read_text() == "new"
    (loop := tmp_path / "loop.csv").symlink_to(loop)
    with pytest.raises(ValueError, match=UNWRITABLE):
        require_output(loop)
    assert loop.is_symlink()
    with whole_file("/dev/null") as temporary:
        temporary.write_text("gone")
    assert Path("/dev/null").is_char_device()
    with pytest.raises(ValueError, match="No space left"), whole_file("/dev/full") as temporary:
        temporary.write_text("nothing")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_full_standard_output_is_a_sentence():
    with Path("/dev/full").open("w") as full:
        result = subprocess.run(
            [sys.executable, "-m", "bem", "--help"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert result.returncode != 0
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("data", ["gr\u00fcn\n", "gr\u00fcn\n".encode(), memoryview("gr\u00fcn\n".encode())])
def test_a_file_is_replaced_whole(data, tmp_path):
    path = tmp_path / "a.json"
    path.write_text("former")
    write_whole(path, data, tmp_path / "first")
    assert path.read_bytes() == "gr\u00fcn\n".encode()
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("refused", ["os.fsync", "pathlib.Path.replace"])
def test_irreplaceable_file_stays(refused, tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    path = tmp_path / "a.json"
    path.write_text("former")
    monkeypatch.setattr(refused, refuse)
    with pytest.raises(OSError, match="No space left"):
        write_whole(path, "new")
    assert listing(tmp_path) == {"a.json": "former"}


def test_unopenable_folders_are_written_to(tmp_path, monkeypatch):
    def refuse(*_):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr("os.open", refuse)
    write_whole(tmp_path / "a.json", "new")
    assert (tmp_path / "a.json").read_text() == "new"


def test_ctrl_c_waits_for_all_files(tmp_path, monkeypatch):
    first, second = tmp_path / "a.csv", tmp_path / "b.csv"
    for path in (first, second):
        path.write_text("old")
    replace = Path.replace

    def interrupted(self, target):
        signal.raise_signal(signal.SIGINT)
        return replace(self, target)

    def written():
        with Outputs(first, second) as outputs:
            for path in (first, second):
                with outputs.write(path) as temporary:
                    temporary.write_text("new")

    monkeypatch.setattr(Path, "replace", interrupted)
    # A process in the background ignores the signal.
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            written()
    finally:
        signal.signal(signal.SIGINT, former)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.csv": "new", "b.csv": "new"}
