"""What the figures and tables of predictions and their errors show, from small result files."""

import pytest
from matplotlib.colors import to_rgba

from paper_figures.figures import models, predictions, quartiles
from paper_figures.style import drawing, models_style
from tests.paper_figures.results import comparison


def test_figure_6_and_the_graphical_abstract_plot_solver_and_prediction(regimes, errors):
    _, panel, _, _ = predictions.figure_6(regimes).axes
    assert panel.get_title(loc="right") == r"$\mu = 3.2$, long dwell"
    markers = {line.get_label(): line for line in panel.lines if line.get_label().startswith("(")}
    assert list(markers) == ["(4)", "(5)", "(6)"]
    assert markers["(5)"].get_xydata().tolist() == [[0.0, 0.5], [5.0, -5.0]]
    assert {line.get_marker() for line in markers.values()} == {"^"}
    assert len({line.get_color() for line in markers.values()}) == 3
    assert [text.get_text() for text in panel.texts] == ["(4)", "(5)", "(6)"]
    assert [text.xy for text in panel.texts] == [(n, -1.1 * n) for n in (4, 5, 6)]
    _, model, force = predictions.graphical_abstract(regimes, errors).axes
    text = " ".join(text.get_text() for text in model.texts)
    assert "pull-off force 1.5 %, hysteresis 1.5 %" in text
    assert "6 ms a prediction, solver 10 ms" in text
    (predicted,) = [line for line in force.lines if line.get_label() == "M1-concat"]
    assert predicted.get_marker() == models_style.marker("M1-concat")["marker"]
    assert predicted.get_color() == models_style.color("M1-concat")
    assert predicted.get_ydata().tolist() == [0.5, -5.0]


def test_figure_7_counts_every_trajectory_once(errors):
    drawn = quartiles.figure_7(errors)
    for axes in drawn.axes[:2]:
        assert sum(patch.get_height() for patch in axes.patches) == pytest.approx(100.0)
        assert sorted(line.get_xdata()[0] for line in axes.lines) == [1.5, 6.0]
        drawn.draw_without_rendering()
        highest = max(patch.get_window_extent().y1 for patch in axes.patches)
        assert axes.get_legend().get_window_extent().y0 > highest
    other = errors | {"overall": {name: one | {"median": 3.0} for name, one in errors["overall"].items()}}
    for axes in quartiles.figure_7(other | {"by_paper_recipe": errors}).axes[:2]:
        labels = [text.get_text() for text in axes.get_legend().get_texts()]
        assert labels == ["our recipe, median 3 %", "median 1.5 %", "90th percentile 6 %"]
    points = drawn.axes[2].lines
    assert sum(len(line.get_xdata()) for line in points) == 8
    legend = drawn.legends[0]
    colors = [patch.get_facecolor() for patch in legend.get_patches()]
    named = dict(zip((text.get_text() for text in legend.get_texts()), colors, strict=True))
    assert {line.get_label(): to_rgba(line.get_color()) for line in points} == named


def test_figure_fms_transfer_and_its_numbers():
    forces = {n: {"indentation": [0.0, 1.0], "predicted": [0.0, float(n)]} for n in ("100", "120", "140")}
    sample = {"sample": 8, "native": {"indentation": [0.0], "force": [0.0]}, "predictions": forces}
    errors = {n: {"nmae_percent": {"median": float(n), "p90": 2.0 * float(n)}} for n in forces}
    config = {"model": "M1-concat"}
    content = {"config": config, "sample": sample, "test_set": {"trajectories": 3, "errors": errors}}
    first, second = predictions.figure_fms_transfer(content).axes
    assert {line.get_label(): line.get_ydata()[-1] for line in first.lines[2:]}["$N = 140$"] == 140.0
    assert {line.get_marker() for line in first.lines[2:]} == {"^"}
    assert len({line.get_color() for line in first.lines[2:]}) == 3
    heights = [bar.get_height() for bars in second.containers for bar in bars if hasattr(bar, "get_height")]
    assert heights == [100.0, 120.0, 140.0, 200.0, 240.0, 280.0]
    assert [bars.get_label() for bars in second.containers] == ["median", "90th percentile"]
    assert drawing.written(-0.05, ".2f") == "\N{MINUS SIGN}0.05"
    assert drawing.written(3) == "3"
    rounded = {"errors": {n: {"nmae_percent": {"median": 0.7749, "p90": 2.0}} for n in ("100", "120")}}
    axes = drawing.figure(height=2.0).subplots()
    predictions.draw_test_set(axes, rounded | {"trajectories": 3}, "black")
    assert [text.get_text() for text in axes.texts] == ["0.77", "0.77", "2.0", "2.0"]


def test_tables(regimes, errors, cracks):
    first = ["(1)", "10", "1", "200", "0.2", "5", "658", "0.01", "0.12", "0.1", "0.006", "8.0e-04", "1.5", "0.5"]
    assert predictions.table_protocols_canonical(regimes).rows[0] == first
    rows = quartiles.table_quartiles(errors).rows
    assert rows[0][:3] == ["Q1", "paper", r"0.0853 $\pm$ 0.0229"]
    assert rows[1][:3] == ["", "our recipe", r"2 $\pm$ 1"]
    both = quartiles.table_quartiles(errors | {"by_paper_recipe": errors}).rows
    assert [row[1] for row in both[:4]] == ["paper", "its recipe", "our recipe", "paper"]
    overall = {"pull_off_force_percent": {"median": 1.5}, "hysteresis_percent": {"median": 0.7}}
    caption = quartiles.table_quartiles(errors | {"overall": errors["overall"] | overall}).caption
    assert "1.5 and 0.7 % by our recipe" in caption
    table = predictions.table_persson_brener(cracks)
    assert table.rows[1] == ["2", "1", "2", "2.2", "2", "2.1", "2.2", "2.3"]
    assert "1.25 % beyond" in table.caption
    assert "surrogate 1.0 % and 3.0 %" in table.caption
    speed = {"models": {"M1-concat": {"seconds_per_batch": {"median": 0.361}}}}
    rows = models.table_models(comparison(["M1-concat"]), speed).rows
    theirs = ["5.00e-04", "0.0092", "0.0148", "-", "2.2", "1.1"]
    assert rows[0] == ["M1-concat, paper", "473,729", "-", *theirs, *["-"] * 5]
    errors = ["0.001", "0.01", "0.02", "0.7", "2", "2"]
    assert rows[1] == ["M1-concat", "100,000", "stated", *errors, "swift", "9,960", "3", "1800", "360"]
    assert rows[2] == ["M1-concat-large", "100,000", "stated", *errors, "swift", "120,000", "3", "1800", "-"]
    unmeasured = models.table_models(comparison(["M1-concat"]))
    assert [unmeasured.header[at] for at in (0, 3, -1)] == ["Model", "MSE", "Batch (ms)"]
    assert unmeasured.rows[1][-1] == "-"
    assert "17 of 18" in unmeasured.caption
    both = comparison(["M2-FiLM", "M1-concat"], by_recipe=["M1-concat"])
    both["beside"]["M1-concat-paper"]["core_seconds"] = None  # trained on a GPU
    rows = models.table_models(both, speed | {"by_paper_recipe": {"M1-concat": {"median": 0.05}}}).rows
    # In the order of the ranking, by the paper's recipe first.
    assert [row[0] for row in rows[1:]] == ["M2-FiLM", "M1-concat-paper", "M1-concat", "M1-concat-large"]
    assert [row[2] for row in rows[1:3]] == ["guessed", "stated"]
    assert [row[-2:] for row in rows[2:4]] == [["on a GPU", "50"], ["1800", "360"]]
