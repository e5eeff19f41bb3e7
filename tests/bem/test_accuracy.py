import numpy as np
import pytest

from bem.accuracy import LOOSEST, NAMED_TARGETS, TIGHTEST, resolve_accuracy

SHRINKING = ("edge_spacing", "curvature", "growth", "widest", "prediction", "residual", "fold_increment")


def test_a_name_is_a_target():
    for name, target in NAMED_TARGETS.items():
        assert resolve_accuracy(name).controls() == resolve_accuracy(target).controls()
        assert resolve_accuracy(name).name == name
    assert NAMED_TARGETS["draft"] > NAMED_TARGETS["standard"] > NAMED_TARGETS["reference"]


def test_a_tighter_target_never_loosens_anything():
    controls = [resolve_accuracy(target).controls() for target in np.geomspace(LOOSEST, TIGHTEST, 30)]
    for name in (*SHRINKING, "longest_step"):
        assert np.all(np.diff([getattr(each, name) for each in controls]) <= 0.0), name
    assert np.all(np.diff([each.far_gap for each in controls]) >= 0.0)
    for name in ("edge_spacing", "prediction", "residual"):
        assert getattr(controls[-1], name) < 0.12 * getattr(controls[0], name)


@pytest.mark.parametrize(("tight", "loose"), [(1e-4, 4e-4), (1e-3, 4e-3)])
def test_spacing_and_curvature_shrink_with_their_order_and_a_little_faster_when_tight(tight, loose):
    fine, coarse = resolve_accuracy(tight).controls(), resolve_accuracy(loose).controls()
    ratio = coarse.edge_spacing / fine.edge_spacing
    unit = 2.8e-3
    assert ratio == pytest.approx(2.0**1.1 if loose < unit else (loose / unit) ** 0.5 * (unit / tight) ** 0.55)
    assert coarse.curvature / fine.curvature == pytest.approx(ratio**2)


def test_a_loose_target_keeps_the_edge_from_being_pinned():
    loose = resolve_accuracy(LOOSEST)
    assert loose.controls().edge_spacing == resolve_accuracy("draft").controls().edge_spacing == 0.12
    assert loose.controls(elastic=True).edge_spacing == 0.1
    assert resolve_accuracy("standard").controls().edge_spacing < 0.12


@pytest.mark.parametrize(
    "accuracy", ["best", "", "1e-3", None, True, 0.0, -1e-3, np.nan, np.inf, 0.06, 1e-5, [1e-3], 1e-3 + 0j]
)
def test_an_unknown_accuracy_is_refused_with_what_is_allowed(accuracy):
    with pytest.raises(ValueError, match=r"^accuracy must be 'draft', 'standard', 'reference' or .*; received"):
        resolve_accuracy(accuracy)
