"""What is timed: the targets of a document's rows, each from an empty folder."""

import json

import pytest

from bem._support.provenance import host
from experiments.cost import target_minutes

MAKEFILE = """
one:
\t@[ ! -e $(OUT)/one ] && touch $(OUT)/one
broken:
\t@echo this is why >&2; false
"""
ROWS = "| Paper | Target |\n|---|---|\n| a | `make one` | x |\n| b | `make {}` | x |\n"


@pytest.fixture
def project(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "Makefile").write_text(MAKEFILE, encoding="utf-8")
    (tmp_path / "rows.md").write_text(ROWS.format("one one"), encoding="utf-8")
    return tmp_path


def test_every_row_is_timed_from_an_empty_folder(project):
    out = project / "minutes.json"
    target_minutes.main(project / "rows.md", None, out)
    found = json.loads(out.read_text(encoding="utf-8"))["minutes"]
    assert list(found) == ["one", "one one"]
    assert all(0.0 < minutes < 1.0 for minutes in found.values())
    assert list((project / "build").iterdir()) == []
    kept = {"host": host(), "minutes": {"one": 5.0, "one one": 6.0, "gone": 7.0}}
    out.write_text(json.dumps(kept), encoding="utf-8")
    target_minutes.main(project / "rows.md", ["one-one"], out)
    found = json.loads(out.read_text(encoding="utf-8"))["minutes"]
    assert list(found) == ["one", "one one"]
    assert found["one"] == 5.0
    assert found["one one"] < 1.0
    out.write_text(json.dumps(kept | {"host": "elsewhere"}), encoding="utf-8")
    with pytest.raises(ValueError, match="rows must be of one machine"):
        target_minutes.main(project / "rows.md", ["one"], out)


def test_what_cannot_be_timed_is_said(project):
    with pytest.raises(ValueError, match="only must be one of the document's rows one, one-one; received 'two'"):
        target_minutes.main(project / "rows.md", ["two"], project / "minutes.json")
    (project / "rows.md").write_text(ROWS.format("broken"), encoding="utf-8")
    with pytest.raises(RuntimeError, match=r"`make broken` failed: .*this is why"):
        target_minutes.main(project / "rows.md", None, project / "minutes.json")
    assert not (project / "minutes.json").exists()
    (project / "rows.md").write_text("nothing", encoding="utf-8")
    with pytest.raises(ValueError, match="rows must name their target"):
        target_minutes.targets(project / "rows.md")
