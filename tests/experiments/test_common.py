"""What the studies share: relative errors, result files that are written whole, what a result was made from."""

import os
import sys

from experiments import common
from experiments.dependencies import Recorder, beside
from experiments.robustness import golden_trajectories


def test_a_relative_error_is_that_of_the_reference():
    assert common.percent(3.0, 2.0) == common.percent(-1.0, -2.0) == 50.0


def test_a_result_takes_the_place_of_the_old_one_and_is_not_written_over_it(tmp_path, monkeypatch):
    out, old = tmp_path / "result.json", tmp_path / "old.json"
    monkeypatch.setattr(golden_trajectories, "GOLDEN", out)
    monkeypatch.setattr(golden_trajectories, "computed", dict)
    for write in (lambda: common.write_result(out, "study", {"a": 1}), golden_trajectories.main):
        out.write_text("old", encoding="utf-8")
        old.hardlink_to(out)
        write()
        assert out.read_text(encoding="utf-8").startswith("{")
        assert old.read_text(encoding="utf-8") == "old"
        old.unlink()


def test_what_a_run_wrote_itself_is_no_input(tmp_path, monkeypatch):
    hooks = []
    monkeypatch.setattr(sys, "addaudithook", hooks.append)
    monkeypatch.chdir(tmp_path)
    recorder = Recorder()
    for name, flags in (("in.csv", os.O_RDONLY), ("out.csv", os.O_WRONLY), ("out.csv", os.O_RDONLY)):
        (tmp_path / name).touch()
        hooks[0]("open", (name, "r", flags))
    recorder.write(tmp_path / "made.json")
    rule = beside(tmp_path / "made.json").read_text(encoding="utf-8")
    assert "in.csv" in rule
    assert "out.csv" not in rule
