"""What the studies share: relative errors and result files that are written whole."""

from experiments import common
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
