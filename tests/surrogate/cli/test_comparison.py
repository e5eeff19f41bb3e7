"""What `surrogate predict --check` says of a prediction beside the solver."""

from types import SimpleNamespace

import numpy as np

from bem import PiecewiseLinearProtocol, Scene, StandardLinearSolid, simulate
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


def test_the_solver_is_told_from_the_predictions_where_they_agree(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda self, *_, **__: drawn.append(self))
    time = np.linspace(0.0, 1.0, 5)
    curves = [
        SimpleNamespace(time=time, indentation=time, force=time, model="M1-concat", force_lower=None) for _ in range(3)
    ]
    plot_predictions(tmp_path / "a.png", curves, curves)
    for axes in drawn[0].axes:
        predicted, solver = axes.lines[1::2], axes.lines[2::2]
        assert len(solver) == len(predicted) == 3
        assert {line.get_color() for line in solver} == {COLOURS["solver"]}
        assert predicted[0].get_color() == COLOURS["M1"]
        assert {line.get_linestyle() for line in solver} == {"--"}
        assert solver[0].get_linewidth() < predicted[0].get_linewidth()
        assert len({line.get_color() for line in predicted}) == 3
