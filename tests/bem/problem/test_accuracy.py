import numpy as np
import pytest

from bem import Scene, StandardLinearSolid, simulate
from bem.problem.accuracy import LOOSEST, NAMED_TARGETS, TIGHTEST, resolve_accuracy
from tests.validation.cases import ramps

SHRINKING = ("edge_spacing", "curvature", "growth", "widest", "prediction", "residual", "fold_increment")


def test_a_name_is_a_target():
    for name, target in NAMED_TARGETS.items():
        assert resolve_accuracy(name).controls() == resolve_accuracy(target).controls()
    assert NAMED_TARGETS["draft"] > NAMED_TARGETS["standard"] > NAMED_TARGETS["reference"]


def test_tighter_target_loosens_nothing():
    controls = [resolve_accuracy(target).controls() for target in np.geomspace(LOOSEST, TIGHTEST, 30)]
    for name in (*SHRINKING, "longest_step"):
        assert np.all(np.diff([getattr(settings, name) for settings in controls]) <= 0.0), name
    assert np.all(np.diff([settings.far_gap for settings in controls]) >= 0.0)
    for name in ("edge_spacing", "prediction", "residual"):
        assert getattr(controls[-1], name) < 0.12 * getattr(controls[0], name)


@pytest.mark.parametrize("resistance", [0.0, 1.0])
def test_controls_are_continuous(resistance):
    below, above = (resolve_accuracy(2.8e-3 * factor) for factor in (1 - 1e-9, 1 + 1e-9))
    assert below.controls(resistance) == pytest.approx(above.controls(resistance), rel=1e-7)
    assert below.line_controls() == pytest.approx(above.line_controls(), rel=1e-7)


@pytest.mark.parametrize(("tight", "loose"), [(1e-4, 4e-4), (1e-3, 4e-3)])
def test_no_adhesion_spacing_orders(tight, loose):
    fine, coarse = (resolve_accuracy(target).line_controls() for target in (tight, loose))
    ratio = coarse.edge_spacing / fine.edge_spacing
    unit = 2.8e-3
    assert ratio == pytest.approx(2.0**1.1 if loose < unit else (loose / unit) ** 0.5 * (unit / tight) ** 0.55)
    assert coarse.curvature / fine.curvature == pytest.approx(ratio**2)


def test_loose_target_leaves_no_pinned_edge():
    for name in ("draft", LOOSEST):
        assert resolve_accuracy(name).controls(0.0).edge_spacing == 0.10
        assert resolve_accuracy(name).controls(1.0).edge_spacing <= 0.37
    spacing = [resolve_accuracy("standard").controls(resistance).edge_spacing for resistance in (0.0, 0.5, 1.0)]
    assert spacing == sorted(spacing)


def test_loosest_target_holds():
    """This contact has few steps; at a coarser mesh than a draft's its pull-off force erred by 8 %."""
    scene, protocol = Scene(2.0, StandardLinearSolid(0.1)), ramps(10.0, 10.0, 0.1, 3.0)
    loose, fine = (simulate(scene, protocol, accuracy) for accuracy in (LOOSEST, 1e-3))
    assert loose.accuracy == LOOSEST
    assert loose.pull_off_force == pytest.approx(fine.pull_off_force, rel=LOOSEST)
