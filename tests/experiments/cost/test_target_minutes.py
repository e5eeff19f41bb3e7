"""What is timed: the targets of the Makefile's registry, each from an empty folder."""

import json
from types import SimpleNamespace

import pytest

from bem._support.provenance import host
from experiments.cost import target_minutes
from experiments.registry import WHOLE

MAKEFILE = """
{}.paper := result  ## Shown
figures tables paper smoke:
\t@true
one:
\t@[ ! -e $(OUT)/one ] && touch $(OUT)/one
broken:
\t@echo this is why >&2; false
"""


@pytest.fixture
def project(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "Makefile").write_text(MAKEFILE.format("one"), encoding="utf-8")
    return tmp_path


def test_every_target_is_timed_from_an_empty_folder(project):
    out = project / "minutes.json"
    target_minutes.main(project / "Makefile", None, out)
    found = json.loads(out.read_text(encoding="utf-8"))["minutes"]
    assert list(found) == ["one", *WHOLE]
    assert all(0.0 < minutes < 1.0 for minutes in found.values())
    assert list((project / "build").iterdir()) == []
    kept = {"host": host(), "minutes": {"one": 5.0, "paper": 6.0, "gone": 7.0}}
    out.write_text(json.dumps(kept), encoding="utf-8")
    target_minutes.main(project / "Makefile", ["one"], out)
    found = json.loads(out.read_text(encoding="utf-8"))["minutes"]
    assert list(found) == ["one", "paper"]
    assert found["one"] < 1.0
    assert found["paper"] == 6.0
    out.write_text(json.dumps(kept | {"host": "elsewhere"}), encoding="utf-8")
    with pytest.raises(ValueError, match="rows must be of one machine"):
        target_minutes.main(project / "Makefile", ["one"], out)


def test_sixty_seconds_are_a_minute(project, monkeypatch):
    instants = iter([0.0, 120.0])
    monkeypatch.setattr(target_minutes, "time", SimpleNamespace(perf_counter=lambda: next(instants)))
    assert target_minutes.minutes("smoke") == 2.0


def test_what_cannot_be_timed_is_said(project):
    with pytest.raises(ValueError, match="only must be one of one, figures-tables, paper, smoke; received 'two'"):
        target_minutes.main(project / "Makefile", ["two"], project / "minutes.json")
    (project / "Makefile").write_text(MAKEFILE.format("broken"), encoding="utf-8")
    with pytest.raises(RuntimeError, match=r"`make broken` failed: .*this is why"):
        target_minutes.main(project / "Makefile", None, project / "minutes.json")
    assert not (project / "minutes.json").exists()
