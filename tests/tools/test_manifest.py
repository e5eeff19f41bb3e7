import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import h5py
import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "tools" / "manifest.py"
SPEC = importlib.util.spec_from_file_location("manifest", SCRIPT)
manifest = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(manifest)


@pytest.fixture
def published(tmp_path):
    root = tmp_path / "published"
    (root / "models" / "M1").mkdir(parents=True)
    with h5py.File(root / "dataset.h5", "w") as file:
        file.attrs.update(command="bem campaign", seed=3, wall_seconds=12.34, versions='{"python": "3.11"}')
    (root / "models" / "M1" / "run.json").write_text('{"command": "surrogate train", "seed": 1}', encoding="utf-8")
    (root / "models" / "M1" / "history.csv").write_text("epoch\n", encoding="utf-8")
    return root


def test_files_are_entered_with_their_origin(published):
    entered = manifest.add(published, [published / "dataset.h5", published / "models"])
    assert entered == ["dataset.h5", "models/M1/history.csv", "models/M1/run.json"]
    entries = manifest.read(published)
    assert entries["dataset.h5"]["versions"] == {"python": "3.11"}
    assert (entries["dataset.h5"]["seed"], entries["dataset.h5"]["seconds"]) == (3, 12.3)
    assert entries["models/M1/history.csv"]["command"] == "surrogate train"
    assert manifest.problems(published) == []


def test_cards_and_metadata_come_from_the_command_that_writes_them(published):
    metadata, card = published / "dataset.croissant.json", published / "models" / "M1" / "README.md"
    metadata.write_text('{"@type": "sc:Dataset"}', encoding="utf-8")
    card.write_text("# M1\n", encoding="utf-8")
    manifest.add(published, [metadata, published / "models"])
    entries = manifest.read(published)
    assert {entries[path.relative_to(published).as_posix()]["command"] for path in (metadata, card)} == {"make cards"}
    assert entries["models/M1/run.json"]["command"] == "surrogate train"


def test_changes_are_noticed(published):
    manifest.add(published, [published])
    (published / "models" / "M1" / "history.csv").write_text("epocH\n", encoding="utf-8")
    (published / "dataset.h5").unlink()
    (published / "stray.json").write_text("{}", encoding="utf-8")
    assert manifest.problems(published) == [
        "dataset.h5 is missing",
        "models/M1/history.csv is not the file that was published",
        "stray.json is not in the manifest",
    ]
    manifest.add(published, [published / "models"])
    assert manifest.problems(published) == ["stray.json is not in the manifest"]


def test_nothing_else_may_lie_there(published, tmp_path):
    manifest.add(published, [published])
    folder = published / "models" / "M1"
    for name in ("README.md", "MANIFEST.json"):
        (folder / name).write_text("{}", encoding="utf-8")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "a.csv").write_text("", encoding="utf-8")
    (published / "linked").symlink_to(tmp_path / "elsewhere")
    (published / "dangling.json").symlink_to(tmp_path / "nowhere")
    (published / "README.md").write_text("What is here.", encoding="utf-8")
    assert manifest.problems(published) == [
        f"{name} is not in the manifest"
        for name in ("dangling.json", "linked", "models/M1/MANIFEST.json", "models/M1/README.md")
    ]
    with pytest.raises(ValueError, match=r"must not be links; received '.*dangling\.json'"):
        manifest.add(published, [published])


def test_a_link_is_not_the_file_that_was_published(published, tmp_path):
    manifest.add(published, [published])
    (published / "dataset.h5").rename(tmp_path / "dataset.h5")
    (published / "dataset.h5").symlink_to(tmp_path / "dataset.h5")
    (published / "models").rename(tmp_path / "models")
    (published / "models").symlink_to(tmp_path / "models")
    assert manifest.problems(published) == [
        "dataset.h5 is no plain file",
        "models/M1/history.csv is missing",
        "models/M1/run.json is missing",
        "models is not in the manifest",
    ]


@pytest.mark.parametrize("entry", [{"sha256": "0"}, {"bytes": 1}, [], None])
def test_an_entry_without_sum_or_size_is_refused_in_one_sentence(entry, published, capsys, monkeypatch):
    (published / "MANIFEST.json").write_text(json.dumps({"files": {"dataset.h5": entry}}), encoding="utf-8")
    monkeypatch.setattr(sys, "argv", ["manifest", "--root", str(published), "verify"])
    assert manifest.main() == 2
    said = capsys.readouterr().err
    assert "expected sha256 and bytes of every file" in said
    assert said.count("\n") == 1


def test_a_damaged_hdf5_file_ends_in_one_sentence(published, capsys, monkeypatch):
    content = (published / "dataset.h5").read_bytes()
    (published / "dataset.h5").write_bytes(content[:100])
    monkeypatch.setattr(sys, "argv", ["manifest", "--root", str(published), "add", str(published / "dataset.h5")])
    assert manifest.main() == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_impossible_entries_are_refused(published, tmp_path):
    with pytest.raises(FileNotFoundError, match="published file not found"):
        manifest.add(published, [published / "absent"])
    (tmp_path / "outside.csv").write_text("", encoding="utf-8")
    with pytest.raises(ValueError, match="must lie in 'published'"):
        manifest.add(published, [tmp_path / "outside.csv"])
    (published / "orphan.csv").write_text("", encoding="utf-8")
    with pytest.raises(ValueError, match=r"needs the command that made it; received 'orphan.csv'"):
        manifest.add(published, [published / "orphan.csv"])
    manifest.add(published, [published / "orphan.csv"], command="make it")
    (published / "MANIFEST.json").write_text("[]", encoding="utf-8")
    with pytest.raises(ValueError, match="expected a manifest"):
        manifest.problems(published)


def test_command_line(published):
    def run(*arguments):
        command = [sys.executable, SCRIPT, "--root", published, *arguments]
        return subprocess.run(command, capture_output=True, text=True)

    assert run("verify").returncode == 1
    assert run("add", published / "dataset.h5", "--seed", "9").returncode == 0
    assert json.loads((published / "MANIFEST.json").read_text(encoding="utf-8"))["files"]["dataset.h5"]["seed"] == 9
    result = run("verify")
    assert (result.returncode, result.stderr) == (
        1,
        "manifest: models/M1/history.csv is not in the manifest\nmanifest: models/M1/run.json is not in the manifest\n",
    )
    result = run("add", published / "absent")
    assert (result.returncode, result.stderr.count("\n")) == (2, 1)


def test_what_is_published_matches():
    assert "dataset.h5" in manifest.read(ROOT / "published")
    assert manifest.problems(ROOT / "published") == []


def test_only_what_is_new_is_listed(published, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["manifest", "--root", str(published), "add", str(published / "models")])
    assert manifest.main() == 0
    assert capsys.readouterr().out.count("is in the manifest") == 2
    (published / "models" / "M1" / "history.csv").write_text("epoch\n1\n", encoding="utf-8")
    assert manifest.main() == 0
    assert capsys.readouterr().out == "models/M1/history.csv is in the manifest\nunchanged: 1\n"
