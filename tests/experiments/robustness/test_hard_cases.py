"""The named extremes, at several accuracies."""

import numpy as np
import pytest

from bem import LoadingProtocol
from bem.reference_solutions import jkr
from experiments.robustness import hard_case_map
from experiments.robustness.hard_case_map import compared, relative_change


def test_extremes():
    named = hard_case_map.extremes()
    assert len(named) == 19
    for scene, protocol in named.values():
        if isinstance(protocol, LoadingProtocol):
            assert protocol.peak_indentation > protocol.start(scene.tabor)
    assert hard_case_map.creeping(3.2, 0.05, 1.0).indentations[3] == jkr.fold_indentation(3.2) + 0.05
    found = compared(*named["snap-in and snap-off, elastic"])
    assert (found["status"], found["refined_status"], found["jumps"]) == ("completed", "completed", 2)
    assert found["energy"] > 0.0
    assert found["change"] < 4e-3
    assert set(found["coarse"]) == {"draft", "0.05"}
    assert all(one["status"] == "completed" and one["change"] < 0.5 for one in found["coarse"].values())
    found = compared(*named["stiff glass without adhesion"])
    assert found["change"] == found["coarse"]["draft"]["change"] == 0.0  # there is no pull-off force
    assert relative_change(1.0, 0.0) == np.inf
    assert relative_change(1.02, 1.0) == pytest.approx(0.02)
