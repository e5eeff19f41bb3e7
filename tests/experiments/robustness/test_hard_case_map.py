"""The map of hard cases at single points and one named extreme."""

from bem import LoadingProtocol
from experiments.robustness import hard_case_map


def test_extremes_and_map():
    named = hard_case_map.extremes()
    assert len(named) == 19
    for scene, protocol in named.values():
        if isinstance(protocol, LoadingProtocol):
            assert protocol.peak_indentation > protocol.start(scene.tabor)
    found = hard_case_map.pair(*named["snap-in and snap-off, elastic"])
    assert (found["status"], found["jumps"], found["refined_jumps"]) == ("completed", 2, 2)
    assert found["energy"] > 0.0
    assert found["change"] < 4e-3
    points = hard_case_map.drawn("beyond", 4, 1)
    assert all(point["peak_indentation"] <= 200.0 * point["tabor"] ** -1.5 for point in points)
    assert hard_case_map.mapped(hard_case_map.drawn("inside", 1, 3)[0])["finite"]


def test_extremes_are_run_more_coarsely_too():
    found = hard_case_map.extreme("jumps", *hard_case_map.extremes()["snap-in and snap-off, elastic"])
    assert set(found["coarse"]) == {"draft", "0.05"}
    assert all(one["status"] == "completed" and one["change"] < 0.5 for one in found["coarse"].values())
