"""The settings of the report are read off the code that carries them out."""

import pytest

from experiments.paper import adopted_settings
from experiments.places import CONFIGS


def test_the_settings_are_the_papers_own(monkeypatch):
    found = adopted_settings.recipe()
    assert (found["batch_size"], found["learning_rate"], found["stop_after"]) == (8, 1e-4, 30)
    assert "plateau" not in found
    found = adopted_settings.crack_protocol()
    assert found["tabor"] == 3.24
    assert found["alpha"] == pytest.approx(0.349066, rel=1e-5)
    assert found["radius_over_gap"] == 100.0
    monkeypatch.setattr(adopted_settings, "layers", dict)
    found = adopted_settings.study(CONFIGS)["closed_forms"]
    assert found == pytest.approx({"jkr_pull_off": 1.5, "dmt_pull_off": 2.0})
    rows = [dict.fromkeys(adopted_settings.QUANTITIES, value) for value in (1.0, 2.0)]
    monkeypatch.setattr(adopted_settings, "paper_rows", lambda _: rows)
    with pytest.raises(ValueError, match="differ in the unloading rate alone"):
        adopted_settings.crack_protocol()
