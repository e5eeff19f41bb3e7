"""What the studies share: result files that are written whole."""

from experiments import common


def test_a_result_takes_the_place_of_the_old_one_and_is_not_written_over_it(tmp_path):
    out, old = tmp_path / "result.json", tmp_path / "old.json"
    out.write_text("old", encoding="utf-8")
    old.hardlink_to(out)
    common.write_result(out, "study", {"a": 1})
    assert out.read_text(encoding="utf-8").startswith("{")
    assert old.read_text(encoding="utf-8") == "old"
