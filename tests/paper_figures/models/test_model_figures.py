"""What the figures that compare models, feature sets and shares of the data plot, from small result files."""

import numpy as np
import pytest

from paper_figures.figures import figure_5
from paper_figures.models import figure_features, figure_learning_curves, figure_mse_mae, figure_plateau
from paper_figures.style import drawing, models_style
from paper_figures.tables import table_models
from surrogate.architectures.naming import FAMILIES, paper_names
from tests.paper_figures.results import HISTORY, comparison, efficiency, outdated, ranking


def test_other_recipe_is_not_untrained(cracks):
    compared = outdated(comparison(paper_names()), "M2-FiLM")
    kept = [figure_mse_mae.compose(compared), figure_learning_curves.compose(compared)]
    kept.append(figure_5.compose(compared, cracks, efficiency()))
    assert {drawn.get_supxlabel() for drawn in kept} == {"trained with another recipe: M2-FiLM"}
    text = table_models.compose(compared).caption
    assert "M2-FiLM is left out: `make models` trains it again." in text
    assert "ot trained yet" not in text


@pytest.mark.parametrize("trained", [["M1-concat"], paper_names()], ids=["one", "all"])
def test_figure_mse_mae_names_untrained(trained):
    drawn = figure_mse_mae.compose(comparison(trained))
    axes = drawn.axes[0]
    plotted = {line.get_label(): line for line in axes.lines if line.get_label() in paper_names()}
    assert list(reversed(plotted)) == trained
    assert plotted["M1-concat"].get_xydata().tolist() == [[1e-3, 1e-2]]
    assert plotted["M1-concat"].get_color() == models_style.color("M1-concat")
    paper = drawing.paper_values("reference_model")
    assert axes.lines[0].get_xydata().tolist() == [[paper["mse"], paper["mae"]]]
    note = drawn.get_supxlabel()
    assert ("17 of 18" in note) == (len(trained) == 1)


def test_recipes_have_panels_of_their_own(cracks):
    compared = comparison(paper_names(), ["M1-concat", "M2-concat"])
    drawn = figure_mse_mae.compose(compared, ranking(SEEDS))
    points = [{line.get_label(): line.get_xydata()[0].tolist() for line in axes.lines} for axes in drawn.axes]
    assert [len(panel.keys() & set(paper_names())) for panel in points] == [2, 18]
    assert points[0]["M1-concat"] == [2e-3, 2e-2]
    assert "16 of 18" in drawn.get_supxlabel()
    *curves, sizes, energies, shares = figure_5.compose(compared, cracks, efficiency(), ranking(SEEDS)).axes
    assert [axes.get_title() for axes in curves] == list(FAMILIES)
    assert [axes.lines[0].get_label() for axes in curves[:2]] == ["M1", "M2"]
    assert [len(axes.lines) for axes in curves] == [3, 3, 2, 2, 2, 2]  # of each model a curve, with a mark or in grey
    assert not curves[0].collections  # seeds by swift
    assert curves[0].get_ylabel() == "concat, paper’s recipe\nvalidation MSE"
    assert sorted(line.get_label() for line in sizes.lines if line.get_label() in paper_names()) == [
        "M1-concat",
        "M2-concat",
    ]
    assert {"M1-concat, paper’s recipe", "M1-concat, swift"} <= {line.get_label() for line in energies.lines}
    assert [100.0, 2e-3] in [line.get_xydata()[0].tolist() for line in shares.lines]
    assert shares.get_title(loc="right") == "M1-concat, swift"


def test_figure_plateau_draws_published_ones():
    with pytest.raises(FileNotFoundError, match="make model-paper-recipe"):
        figure_plateau.compose(comparison(paper_names()))
    compared = comparison(paper_names(), ["M1-concat"])
    compared["beside"]["M1-concat-as-worded"] = {"history": HISTORY | {"learning_rate": [1e-4] * 3}}
    errors, rates = figure_plateau.compose(compared).axes
    assert [line.get_label() for line in rates.lines] == list(figure_plateau.LOOKS)
    assert [line.get_ydata()[-1] for line in rates.lines] == [5e-5, 1e-4, 5e-5]
    assert all(line.get_ydata().tolist() == HISTORY["validation_mse"] for line in errors.lines)


def test_figure_5_with_one_model(cracks):
    curves, *_, sizes, energies, _ = figure_5.compose(comparison(["M1-concat"]), cracks, efficiency()).axes
    assert curves.lines[0].get_ydata().tolist() == HISTORY["validation_mse"]
    assert curves.lines[1].get_xydata().tolist() == [[2.0, 0.1]]
    assert sizes.lines[-1].get_xydata().tolist() == [[100.0, 2e-2]]
    assert sizes.get_title(loc="right") == "swift"
    by_label = {line.get_label(): line.get_xydata() for line in energies.lines}
    assert by_label["Persson-Brener"].tolist() == [[0.1, 1.0], [10.0, 5.0]]
    assert by_label["solver"][3].tolist() == [4.0, 2.2]
    assert by_label["solver, own velocity"][3].tolist() == pytest.approx([4.4, 2.2])
    assert by_label["M1-concat, paper’s recipe"][3].tolist() == [4.0, 2.3]
    assert "1.25 %" in energies.get_title(loc="right")
    shares = figure_5.compose(comparison(paper_names()), cracks, efficiency()).axes[-1]
    points = shares.containers[0].lines[0].get_xydata()
    np.testing.assert_allclose(points, [[12.5, 1.0 / 12.5], [25.0, 0.04], [75.0, 1.0 / 75.0]])
    assert shares.containers[0].get_label() == "mean of 1 or 2 folds"
    assert [100.0, 5e-3] in [line.get_xydata()[0].tolist() for line in shares.lines]


def test_curve_figures_name_what_is_missing():
    panels = figure_learning_curves.compose(comparison(paper_names())).axes
    assert [axes.lines[0].get_label() for axes in panels] == [*FAMILIES, *FAMILIES]
    trained = ["M1-concat", "M1-FiLM", "M4-gated"]
    for old, marked in ((trained[1:], []), (trained[1:2], [9]), (trained[2:], [0])):
        drawn = figure_learning_curves.compose(outdated(comparison(trained), *old))
        assert [place for place, axes in enumerate(drawn.axes) if len(axes.lines) > 1] == marked
        assert "trained with another recipe: " in drawn.get_supxlabel()
    sets = {name: {"validation_mse": 0.1, "mse": 0.2, "history": HISTORY} for name in "ABCD"}
    first, second = figure_features.compose({"sets": sets}, efficiency(), comparison(["M1-concat"]))[
        "figure-features"
    ].axes
    assert len(first.lines) == 8
    assert first.lines[1].get_xydata().tolist() == [[2.0, 0.1]]
    assert [line.get_label() for line in second.lines[::2]] == ["100 %", "75 %", "25 %", "12.5 %"]


SEEDS = {"M1-concat": 3, "M1-gated": 2, "M2-concat": 1}
NOTE = "median, least and largest of 3 or 2 or 1 seeds each"


def whiskers(axes):
    """Ends of the vertical error bars, by their place."""
    segments = [line for bars in axes.containers for group in bars.lines[2] for line in group.get_segments()]
    return {float(line[0][0]): sorted(line[:, 1].tolist()) for line in segments if line[0][0] == line[1][0]}


def test_seeds_are_medians_with_whiskers(cracks):
    compared, spread = comparison(paper_names()), ranking(SEEDS)
    kept = figure_mse_mae.compose(compared, spread), figure_5.compose(compared, cracks, efficiency(), spread)
    for axes, x, y, single in ((kept[0].axes[0], "test_mse", "test_mae", [3e-3, 3e-2]),):
        plotted = {
            line.get_label(): line.get_xydata()[0].tolist() for line in axes.lines if line.get_label() in paper_names()
        }
        assert list(reversed(plotted)) == paper_names()
        ends = whiskers(axes)
        assert len(ends) == 2
        for name in ("M1-concat", "M1-gated"):
            ends_of_model = spread["spread"][name]
            assert plotted[name][1] == ends_of_model[y]["median"]
            assert x is None or plotted[name][0] == ends_of_model[x]["median"]
            assert ends[plotted[name][0]] == pytest.approx([ends_of_model[y]["min"], ends_of_model[y]["max"]])
        # One seed beside the published training is no spread.
        assert single is None or plotted["M1-FiLM"] != plotted["M2-concat"]
        assert x is None or plotted["M2-concat"][0] == comparison(paper_names())["models"]["M2-concat"]["mse"]
    for drawn in kept:
        assert drawn.get_supxlabel() == NOTE
    compared, spread = comparison(paper_names()), ranking(SEEDS)
    kept = figure_5.compose(compared, cracks, efficiency(), spread), figure_learning_curves.compose(compared, spread)
    for axes, name in ((kept[0].axes[0], "M1-concat"), (kept[1].axes[len(FAMILIES)], "M1-gated")):
        (band,) = axes.collections
        curves = np.array(spread["curves"][name])
        heights = band.get_paths()[0].vertices[:, 1]
        assert (heights.min(), heights.max()) == (curves.min(), curves.max())
        assert axes.lines[0].get_ydata().tolist() == pytest.approx(np.median(curves, axis=0).tolist())
        assert axes.lines[1].get_xdata().tolist() == [2]
        assert axes.lines[2].get_ydata().tolist() == HISTORY["validation_mse"]
    assert not kept[1].axes[0].collections


def test_feature_seeds_are_bands_and_rows():
    sets = {name: {"validation_mse": 0.1, "mse": 0.2, "history": HISTORY} for name in "ABCD"}
    spread = ranking({"features-C": 2, "features-D": 1})
    figure, table = figure_features.compose({"sets": sets}, efficiency(), comparison(["M1-concat"]), spread).values()
    labels = [line.get_label() for line in figure.axes[0].lines[::2]]
    assert [label[0] for label in labels] == list("ABCD")
    assert labels[2].endswith("(1.0e-04 to 1.2e-04, 2 seeds)")
    assert labels[3].endswith("(1.0e-01)")
    rows = table.rows
    assert [row[2] for row in rows] == ["1", "1", "2", "1"]
    assert rows[0][3:] == ["0.1", "0.2"]
    assert rows[2][3:] == ["6.00e-05 (5.00e-05 to 6.00e-05)"] * 2
