"""What the figures of the reference model's predictions and errors plot, from small result files."""

import pytest
from matplotlib.colors import to_rgba

from paper_figures.figures import figure_6, figure_7, graphical_abstract
from paper_figures.models import figure_fms_transfer
from paper_figures.style import drawing, models_style


def test_figure_6_and_graphical_abstract(regimes, errors):
    drawn = figure_6.compose(regimes)
    titles = [axes.get_title(loc="right") for axes in drawn.axes]
    assert titles == [f"({sample}), pull-off error 1.5 %" for sample in range(1, 13)]
    assert drawn.axes[3].get_ylabel().startswith(r"$\mu = 3.2$, long dwell")
    predicted = next(line for line in drawn.axes[4].lines if line.get_marker() == "^")
    assert predicted.get_xydata().tolist() == [[0.0, 0.5], [5.0, -5.0]]
    *contacts, protocol, model, force = graphical_abstract.compose(regimes, errors).axes
    assert [axes.get_title() for axes in contacts] == ["1  pressed", "2  relaxed", "3  pull-off"]
    assert [text.get_text() for text in protocol.texts] == ["1", "2", "3"]
    text = " ".join(text.get_text() for text in model.texts)
    assert "pull-off force 1.5 %, hysteresis 1.5 %" in text
    assert "Keras call 100 ms, solver 10 ms" in text
    (predicted,) = [line for line in force.lines if line.get_label() == "M1-concat, paper’s recipe"]
    assert predicted.get_marker() == models_style.marker("M1-concat")["marker"]
    assert predicted.get_color() == models_style.color("M1-concat")
    assert predicted.get_ydata().tolist() == [0.5, -5.0]


def test_figure_7_counts_trajectories_once(errors):
    drawn = figure_7.compose(errors | {"swift": None})
    for axes in drawn.axes[:2]:
        assert sum(patch.get_height() for patch in axes.patches) == pytest.approx(100.0)
        assert sorted(line.get_xdata()[0] for line in axes.lines) == [1.5, 6.0]
        drawn.draw_without_rendering()
        highest = max(patch.get_window_extent().y1 for patch in axes.patches)
        assert axes.get_legend().get_window_extent().y0 > highest
    for axes in figure_7.compose(errors).axes[:2]:
        labels = [text.get_text() for text in axes.get_legend().get_texts()]
        assert labels == ["swift, median 3 %", "median 1.5 %", "90th percentile 6 %"]
    assert "M1-concat, swift" in figure_7.compose(errors | {"paper": None}).legends[0].get_title().get_text()
    points = drawn.axes[2].lines
    assert sum(len(line.get_xdata()) for line in points) == 8
    legend = drawn.legends[0]
    colors = [patch.get_facecolor() for patch in legend.get_patches()]
    named = dict(zip((text.get_text() for text in legend.get_texts()), colors, strict=True))
    assert {line.get_label(): to_rgba(line.get_color()) for line in points} == named


def test_figure_fms_transfer_and_its_numbers():
    predictions = {n: {"indentation": [0.0, 1.0], "predicted": [0.0, float(n)]} for n in ("100", "120", "140")}
    sample = {"sample": 8, "native": {"indentation": [0.0], "force": [0.0]}, "predictions": predictions}
    errors = {n: {"nmae_percent": {"median": float(n), "p90": 2.0 * float(n)}} for n in predictions}
    config = {"model": "M1-concat"}
    study = {"config": config, "paper": {"sample": sample, "test_set": {"trajectories": 3, "errors": errors}}}
    *first, second = figure_fms_transfer.compose(study).axes
    lines = {line.get_label(): line for axes in first for line in axes.lines if line.get_label() != "solver"}
    assert {name: line.get_ydata()[-1] for name, line in lines.items() if name.startswith("$N")} == {
        f"$N = {n}$": float(n) for n in predictions
    }
    assert [axes.get_title(loc="right") for axes in first] == ["$N=100$", "$N=120$", "$N=140$"]
    assert {line.get_marker() for name, line in lines.items() if name.startswith("$N")} == {"^"}
    widths = [bar.get_width() for bars in second.containers for bar in bars if hasattr(bar, "get_width")]
    assert widths == [100.0, 120.0, 140.0, 200.0, 240.0, 280.0]
    assert [bars.get_label() for bars in second.containers] == ["median", "90th percentile"]
    assert drawing.written(-0.05, ".2f") == "\N{MINUS SIGN}0.05"
    assert drawing.written(3) == "3"
    predictions = {"errors": {n: {"nmae_percent": {"median": 0.7749, "p90": 2.0}} for n in ("100", "120")}}
    axes = drawing.figure(height=2.0).subplots()
    figure_fms_transfer.draw_test_set(axes, predictions | {"trajectories": 3}, "black")
    assert [text.get_text() for text in axes.texts] == ["0.77", "median 0.77", "2.0", "90th percentile 2.0"]
