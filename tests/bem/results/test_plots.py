import itertools

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter

from bem import Elastic, ForceProtocol, Scene, StandardLinearSolid, simulate
from bem.results.plots import draw_trajectory, mark_phases
from tests.bem.results.test_trajectory import trajectory_of


def drawn(trajectory):
    history, loop = draw_trajectory(trajectory).axes
    return [axes.lines[1].get_xydata() for axes in (history, loop)]


def test_curve_passes_through_every_record():
    time = np.linspace(0.0, 1.0, 9)
    trajectory = trajectory_of(time, 2.0 * time, np.sin(3.0 * time))
    history, loop = drawn(trajectory)
    assert np.isin(time, history[:, 0]).all()
    np.testing.assert_allclose(history[:, 1], trajectory.at(history[:, 0]))
    np.testing.assert_allclose(loop[:, 0], 2.0 * history[:, 0])


def test_the_curve_breaks_at_a_jump():
    trajectory = trajectory_of([0, 1, 1, 2], [0, 1, 1, 2], [0.0, 1.0, 5.0, 6.0], jump_times=(1.0,))
    history, _ = drawn(trajectory)
    middle = 0.5  # two phases of equal length
    at_jump = history[history[:, 0] == middle, 1]
    assert at_jump[0] == 1.0
    assert at_jump[-1] == 5.0
    assert np.isnan(at_jump[1:-1]).all()
    assert np.isfinite(history[history[:, 0] != middle, 1]).all()


def test_unstarted_trajectory_draws_nothing():
    with pytest.raises(ValueError, match="received status 'refused'"):
        draw_trajectory(trajectory_of([], [], [], status="refused"))


def test_force_control_draws_indentation():
    weight = ForceProtocol(times=[0.0, 1.0, 2.0], forces=[-1.0, -5.0, 1.0])
    trajectory = simulate(Scene(tabor=1.0, material=Elastic()), weight, "draft")
    history, loop = draw_trajectory(trajectory).axes
    np.testing.assert_allclose(history.lines[1].get_ydata().max(), trajectory.indentation.max())
    assert "indentation" in history.get_ylabel()
    np.testing.assert_allclose(
        history.get_xticks() * 2.0, [float(tick.get_text()) for tick in history.get_xticklabels()]
    )
    assert len(history.get_xticks()) > 3
    assert "force" in loop.get_ylabel()
    np.testing.assert_allclose(np.nanmin(loop.lines[1].get_ydata()), -5.0, rtol=1e-3)


@pytest.mark.parametrize("forces", [[0.0, -5.0, -5.0, 8.0], [-1.0, -2.0, -5.0, 1.5]])
def test_pull_off_label_is_inside(forces):
    weight = ForceProtocol(times=[0.0, 0.1, 2.0, 3.0], forces=forces)
    trajectory = simulate(Scene(tabor=1.0, material=StandardLinearSolid(modulus_ratio=0.1)), weight, "draft")
    figure = draw_trajectory(trajectory)
    figure.draw_without_rendering()
    loop = figure.axes[1]
    (label,) = loop.texts
    inside, across = label.get_window_extent(), loop.get_window_extent()
    assert across.x0 < inside.x0
    assert inside.x1 < across.x1


@pytest.mark.parametrize(
    ("corners", "written", "expected"),
    [
        ([0.0, 3.521, 11.862, 11.8756, 11.8776], None, ["0", "3.52", "11.86", "", "11.878"]),
        ([0.0, 1002.21, 1003.21, 1005.4], str, ["0.0", "1002.0", "1003.0", "1005.0"]),
        ([0.0, 5.0, 5.0 + 1e-9, 8.0], EngFormatter("s"), ["0 s", "5 s", "", "8 s"]),
        (np.append(np.arange(8.0), 7.0001) + 1e5, None, None),
    ],
)
def test_instants_do_not_overlap(corners, written, expected, monkeypatch):
    for name in ("font.size", "font.family", "xtick.labelsize"):  # another test may have left others
        monkeypatch.setitem(mpl.rcParams, name, mpl.rcParamsDefault[name])
    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    axes, _ = figure.subplots(1, 2)
    axes.plot([0.0, 1.0], [0.0, 1.0])
    mark_phases(axes, np.array(corners), written)
    figure.draw_without_rendering()
    labels = [label for label in axes.get_xticklabels() if label.get_text()]
    if expected:
        assert [label.get_text() for label in axes.get_xticklabels()] == expected
    boxes = [label.get_window_extent() for label in labels]
    assert len(boxes) > 2
    assert all(left.x1 < right.x0 for left, right in itertools.pairwise(boxes))
