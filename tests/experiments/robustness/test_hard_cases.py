"""The hard cases: single random protocols, and named extremes."""

import numpy as np
import pytest

from bem import LoadingProtocol
from bem.reference_solutions import jkr
from experiments.measurements.cases import Case, drawn, rows_of
from experiments.robustness import hard_case_map
from experiments.robustness.hard_case_map import relative_change


def test_extremes():
    named = hard_case_map.extremes()
    assert len(named) == 19
    for scene, protocol in named.values():
        if isinstance(protocol, LoadingProtocol):
            assert protocol.peak_indentation > protocol.start(scene.tabor)
    assert hard_case_map.creeping(3.2, 0.05, 1.0).indentations[3] == jkr.fold_indentation(3.2) + 0.05
    found = hard_case_map.extreme("jumps", *named["snap-in and snap-off, elastic"])
    assert (found["status"], found["refined_status"], found["jumps"]) == ("completed", "completed", 2)
    assert found["energy"] > 0.0
    assert found["change"] < 4e-3
    assert set(found["coarse"]) == {"draft", "0.05"}
    assert all(one["status"] == "completed" and one["change"] < 0.5 for one in found["coarse"].values())


def test_random_protocols_and_a_contact_without_a_pull_off_force():
    points = rows_of(drawn("beyond", 4, 1, "sobol"))
    assert all(point["peak_indentation"] <= 200.0 * point["tabor"] ** -1.5 for point in points)
    case = Case.of(rows_of(drawn("inside", 1, 3, "sobol"))[0])
    assert hard_case_map.compared(case.scene, case.protocol)["status"] == "completed"
    found = hard_case_map.extreme("stiff glass", *hard_case_map.extremes()["stiff glass without adhesion"])
    assert found["change"] == found["coarse"]["draft"]["change"] == 0.0
    assert relative_change(1.0, 0.0) == np.inf
    assert relative_change(1.02, 1.0) == pytest.approx(0.02)
