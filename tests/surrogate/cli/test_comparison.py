"""What `surrogate predict --check` says of a prediction beside the solver."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bem import LoadingProtocol, PiecewiseLinearProtocol, Scene, StandardLinearSolid, simulate
from bem.plots import COLOURS
from surrogate.cli.comparison import plot_predictions, solver_errors
from surrogate.prediction.predicted import predicted_trajectory


def test_of_several_cycles_the_last_unloading_is_compared():
    # The first is pulled off faster, and so holds on more strongly; the second goes deeper.
    instants, depths = np.array([0.0, 1.0, 1.1, 2.1, 12.1]), np.array([-3.0, 5.0, -3.0, 6.0, -3.0])
    simulated = simulate(
        Scene(1.0, StandardLinearSolid(modulus_ratio=0.1)), PiecewiseLinearProtocol(instants, depths), "draft"
    )
    times = np.unique(np.concatenate([instants, np.linspace(0.0, 12.1, 2000)]))
    predicted = predicted_trajectory(
        times,
        np.interp(times, instants, depths),
        simulated.at(times),
        unloading_from=int(np.searchsorted(times, 2.1)),
        extrapolated=(),
        model="the solver itself",
        seconds=0.0,
    )
    assert simulated.pull_off_force > 1.5 * predicted.pull_off_force
    assert solver_errors(predicted, simulated)["pull_off_percent"] < 1.0
    status, *errors = solver_errors(predicted, replace(simulated, status="stopped")).values()
    assert status == "stopped"
    assert np.isnan(errors).all()


@pytest.fixture
def drawn(monkeypatch):
    """The figures that are saved."""
    figures = []
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda self, *_, **__: figures.append(self))
    return figures


def test_the_solver_is_told_from_the_predictions_where_they_agree(drawn):
    time = np.linspace(0.0, 1.0, 5)
    curve = {"time": time, "corners": time[[0, -1]], "indentation": time, "force": time, "force_lower": None}
    curves = [SimpleNamespace(**curve, model="M1-concat") for _ in range(3)]
    plot_predictions(Path("a.png"), curves, curves)
    for axes in drawn[0].axes:
        predicted, solver = axes.lines[1::2], axes.lines[2::2]
        assert len(solver) == len(predicted) == 3
        assert {line.get_color() for line in solver} == {COLOURS["solver"]}
        assert predicted[0].get_color() == COLOURS["M1"]
        assert {line.get_linestyle() for line in solver} == {"--"}
        assert solver[0].get_linewidth() < predicted[0].get_linewidth()
        assert len({line.get_color() for line in predicted}) == 3


def test_each_phase_has_the_width_that_the_solver_gives_it(drawn):
    # A pull-off a thousand times as slow as the loading.
    ramp = {"peak_indentation": 5.0, "loading_rate": 10.0, "dwell_time": 1.0}
    protocols = [LoadingProtocol(**ramp, unloading_rate=rate) for rate in (0.01, 0.02)]
    simulated = [simulate(Scene(1.0, StandardLinearSolid(modulus_ratio=0.1)), one, "draft") for one in protocols]
    kept = {"unloading_from": 0, "extrapolated": (), "model": "fast", "seconds": 0.0}
    predicted = [predicted_trajectory(one.time, one.indentation, one.force, **kept) for one in simulated]
    plot_predictions(Path("a.png"), predicted[:1], simulated[:1])
    plot_predictions(Path("b.png"), predicted, simulated)
    one, several = (figure.axes[0] for figure in drawn)
    expected = simulated[0].plot().axes[0]
    ticks, wanted = ([(*text.get_position(), text.get_text()) for text in a.get_xticklabels()] for a in (one, expected))
    assert (ticks, one.get_xlabel()) == (wanted, expected.get_xlabel())
    for line in one.lines[1:3]:
        assert line.get_xdata()[[0, -1]].tolist() == [0.0, 1.0]
        assert np.interp(simulated[0].corners[1], simulated[0].time, line.get_xdata()) > 0.1
    # Protocols of different phases share plain time.
    assert several.lines[1].get_xdata().tolist() == simulated[0].time.tolist()
    assert "scale" not in several.get_xlabel()
