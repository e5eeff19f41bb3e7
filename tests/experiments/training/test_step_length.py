"""How well input representations show the length of a step."""

import json

import numpy as np
import pytest

from experiments.training import step_length


def test_steps_of_a_phase_have_their_step_before_in_it():
    found = step_length.phases((5, 3, 4))
    assert {phase: list(steps) for phase, steps in found.items()} == {
        "loading": [2, 3, 4],
        "dwell": [6, 7],
        "unloading": [9, 10, 11],
    }


def test_inputs_of_both_ends_of_a_step_belong_to_its_length():
    scaled = np.arange(12.0).reshape(1, 4, 3)
    inputs, lengths = step_length.seen_and_lengths(scaled, np.array([[0.0, 1.0, 3.0, 7.0]]), np.array([2, 3]))
    np.testing.assert_array_equal(inputs, [[6, 7, 8, 3, 4, 5], [9, 10, 11, 6, 7, 8]])
    np.testing.assert_allclose(lengths, np.log([2.0, 4.0]))


def test_the_length_itself_shows_all_of_it_and_the_edge_marks_nothing(dataset, tmp_path):
    out = tmp_path / "step_length.json"
    step_length.main(dataset, out)
    sets = json.loads(out.read_text(encoding="utf-8"))["sets"]
    assert set(sets) == set("ABCDE")
    assert sets["E"] == pytest.approx(dict.fromkeys(step_length.PHASES, 1.0), abs=1e-6)
    assert sets["D"]["dwell"] == pytest.approx(sets["B"]["dwell"], abs=0.2)
    assert sets["D"]["dwell"] < 0.99
