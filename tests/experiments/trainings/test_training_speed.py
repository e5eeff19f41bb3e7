"""What a batch of training costs each architecture."""

import pytest

from experiments.trainings import training_speed
from surrogate.architectures import naming
from tests.surrogate.conftest import build_tiny


def test_every_architecture_takes_the_same_batches(dataset, monkeypatch):
    # The refinements of SOAP decide how long a block is: ten batches, too many for a network of full size.
    monkeypatch.setattr("surrogate.build", build_tiny)
    monkeypatch.setattr(naming, "names", lambda: ["M3-concat", "M4-gated"])
    monkeypatch.setattr(training_speed, "limit_threads", lambda _: None)
    found = training_speed.study(dataset, repeats=2)
    assert list(found["models"]) == ["M3-concat", "M4-gated"]
    for one in found["models"].values():
        assert one["seconds_per_batch"]["count"] == 2
        epoch_seconds = one["seconds_per_batch"]["median"] * found["batches"]
        assert one["hours"] == pytest.approx(epoch_seconds * found["epochs"] / 3600.0)
    assert {one["count"] for one in found["by_paper_recipe"].values()} == {2}
    for recipe in ("swift", "paper"):
        settings = {"name": recipe, "batch_size": 8}
        known = [training_speed.epoch_seconds(found, settings, one, 80) for one in ("M3-concat", "M4-gated", "M1-FiLM")]
        assert known[0] > 0.0 < known[1]
        assert known[2] is None
    longest = found["longest_training"]
    assert found["longest_training_hours"] == max(one["hours"] for one in found["models"].values())
    assert found["models"][longest]["hours"] == found["longest_training_hours"]


def test_a_chosen_model_is_only_timed(dataset, monkeypatch, capsys):
    monkeypatch.setattr(training_speed, "limit_threads", lambda _: None)
    monkeypatch.setattr(training_speed, "BLOCK", 4)
    monkeypatch.setattr(training_speed, "timed", lambda _, repeats: [10.0] * repeats)
    assert training_speed.study(dataset, recipe="paper", only=["M4-gated"], repeats=1) is None
    assert capsys.readouterr().out.split()[:3] == ["M4-gated", "2500", "ms"]  # ten seconds for four batches
