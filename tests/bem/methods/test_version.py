"""A solver that computes something else has another version."""

import json

import pytest

from bem.methods.version import SOLVER_VERSION
from tests.bem.methods.golden_trajectories import GOLDEN, computed

ANOTHER_PROCESSOR = 1e-7
"""Relative difference that another processor's last digits make at most."""


def test_results_move_only_with_the_version():
    kept = json.loads(GOLDEN.read_text(encoding="utf-8"))
    advice = "raise SOLVER_VERSION and run `make golden-trajectories`, or mend the change"
    assert kept["solver_version"] == SOLVER_VERSION, advice
    trajectories = computed()
    assert trajectories.keys() == kept["trajectories"].keys(), advice
    for name, quantities in kept["trajectories"].items():
        assert trajectories[name] == pytest.approx(quantities, rel=ANOTHER_PROCESSOR, abs=1e-6), f"{name}: {advice}"
