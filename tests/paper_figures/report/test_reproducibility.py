"""The numbers of the page for reviewers, from what is published, with other verdicts in it."""

from pathlib import Path

import pytest

from experiments.common import read_result
from paper_figures.report import reproducibility


def test_page_states_decisions_by_seeds(tmp_path, monkeypatch):
    """One order decided, and the others not, whatever is published by now."""
    ranked = read_result(Path("published/ranking.json"))
    for pair in ranked["pairs"]:
        pair["probability"]["test_mse"] = 0.0 if pair["claim"] == "d_better_than_c" else None
    for name, claim in ranked["claims"].items():
        claim |= {"decision": "fails", "first": "C"} if name == "d_better_than_c" else {"decision": "not decided"}
    text = reproducibility.statements_text(tmp_path, ranked)
    assert text.startswith("- **Hold**: none.\n- **Are ties**: none.\n- **Fail**: none.\n- **Are undecided**: best")
    lines = {line.split(" | ")[0].strip("| "): line for line in text.splitlines()}
    assert "| not yet: 2 to train | - | - | - | - | **fails** | C | D before C: < 0.001 |" in lines["D better than C"]
    claims = {name: {"lacking": ["M1-concat"]} for name in ranked["claims"]}
    claims["d_better_than_c"] = {"lacking": [], "decision": "fails", "first": "C", "ratio": 2, "apart": 1.5, "seeds": 1}
    monkeypatch.setattr(reproducibility, "decisions", lambda *_: {"claims": claims})
    text = reproducibility.statements_text(tmp_path, ranked)
    assert "- **Fail**: D better than C.\n" in text
    lines = {line.split(" | ")[0].strip("| "): line for line in text.splitlines()}
    assert "| **fails** | C | 2.00 | 1.50 | 1 | **fails** | C |" in lines["D better than C"]
    with pytest.raises(FileNotFoundError, match="`make model-forces` makes it"):
        read_result(tmp_path / "model_forces.json")
