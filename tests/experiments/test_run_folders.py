"""The tables of published models, moved from their folders to one file, keep their numbers."""

from pathlib import Path

import pytest

from experiments.run_folders import move_tables, read_table
from surrogate.data.dataset import Split
from tests.experiments.models import SPLIT, write_model

ERRORS = "trajectory,mse\n3,0.1\n4,1e-5\n"


def model(folder, split=SPLIT):
    write_model(folder, split=split, dataset_sha256="d" * 64)
    (folder / "test_errors.csv").write_text(ERRORS)
    return folder


def test_moved_tables_keep_their_numbers(tmp_path):
    folder, second = model(tmp_path / "M1-concat"), model(tmp_path / "M1-FiLM", SPLIT | {"train": [0]})
    before = {path: read_table(path, "history") for path in (folder, second)}
    move_tables(tmp_path)
    assert sorted(path.name for path in folder.iterdir()) == ["metrics.json", "run.json", "split.json"]
    assert sorted(path.name for path in second.iterdir()) == ["metrics.json", "run.json"]
    for path, history in before.items():
        assert {name: column.tolist() for name, column in read_table(path, "history").items()} == {
            name: column.tolist() for name, column in history.items()
        }
        assert read_table(path, "test_errors")["mse"].tolist() == [0.1, 1e-5]
    assert [Split.of(path).train.tolist() for path in before] == [[0, 1], [0]]


def test_new_training_replaces_moved_tables(tmp_path):
    folder = model(tmp_path / "M1-concat")
    move_tables(tmp_path)
    (folder / "test_errors.csv").write_text(ERRORS.replace("0.1", "0.2"))
    assert read_table(folder, "test_errors")["mse"][0] == 0.2
    (folder / "history.csv").write_text("epoch\n1\n")
    move_tables(tmp_path)
    assert read_table(folder, "test_errors")["mse"][0] == 0.2
    with pytest.raises(FileNotFoundError, match="surrogate train"):
        read_table(tmp_path / "M2-concat", "history")


def test_an_interrupted_move_goes_on(tmp_path, monkeypatch):
    folder = model(tmp_path / "M1-concat")
    unlink = Path.unlink

    def interrupted(path, **options):
        unlink(path, **options)
        if path.suffix == ".csv":
            raise KeyboardInterrupt

    with monkeypatch.context() as context:
        context.setattr(Path, "unlink", interrupted)
        with pytest.raises(KeyboardInterrupt):
            move_tables(tmp_path)
    move_tables(tmp_path)
    assert read_table(folder, "test_errors")["mse"].tolist() == [0.1, 1e-5]
    assert read_table(folder, "history")["epoch"].size
