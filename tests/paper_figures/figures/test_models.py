"""What figures and tables of models, seeds, feature sets and shares of the data show, from small result files."""

import numpy as np
import pytest

from paper_figures.figures import features, models, rankings
from paper_figures.style import drawing, models_style
from surrogate.architectures.naming import FAMILIES, names
from tests.paper_figures.results import HISTORY, comparison, efficiency, outdated, ranking


def test_what_is_trained_otherwise_is_not_called_untrained(cracks):
    found = outdated(comparison(names()), "M2-FiLM")
    kept = [models.figure_mse_mae(found), models.figure_learning_curves(found)]
    kept.append(models.figure_5(found, cracks, efficiency()))
    assert {drawn.get_supxlabel() for drawn in kept} == {"trained with another recipe: M2-FiLM"}
    text = models.table_models(found).caption
    assert "M2-FiLM is left out: `make models` trains it again." in text
    assert "ot trained yet" not in text


@pytest.mark.parametrize("trained", [["M1-concat"], names()], ids=["one", "all"])
def test_figure_mse_mae_plots_the_trained_and_names_the_rest(trained):
    drawn = models.figure_mse_mae(comparison(trained))
    axes = drawn.axes[0]
    plotted = {line.get_label(): line for line in axes.lines if line.get_label() in names()}
    assert list(plotted) == trained
    assert plotted["M1-concat"].get_xydata().tolist() == [[1e-3, 1e-2]]
    assert plotted["M1-concat"].get_color() == models_style.color("M1-concat")
    paper = drawing.paper_values("reference_model")
    assert axes.lines[0].get_xydata().tolist() == [[paper["mse"], paper["mae"]]]
    note = drawn.get_supxlabel()
    assert ("17 of 18" in note) == (len(trained) == 1)


def test_figure_mse_mae_shows_the_paper_recipe_in_its_first_panel_only():
    panels = models.figure_mse_mae(comparison(names(), ["M1-concat"])).axes
    assert [sum(line.get_markeredgecolor() == drawing.BLACK for line in axes.lines) for axes in panels] == [1, 0]


def test_figure_plateau_draws_the_trainings_that_are_published():
    with pytest.raises(FileNotFoundError, match="make model-paper-recipe"):
        models.figure_plateau(comparison(names()))
    found = comparison(names(), ["M1-concat"])
    found["beside"]["M1-concat-as-worded"] = {"history": HISTORY | {"learning_rate": [1e-4] * 3}}
    errors, rates = models.figure_plateau(found).axes
    assert [line.get_label() for line in rates.lines] == list(models.LOOKS)
    assert [line.get_ydata()[-1] for line in rates.lines] == [5e-5, 1e-4, 5e-5]
    assert all(line.get_ydata().tolist() == HISTORY["validation_mse"] for line in errors.lines)


def test_figure_5_with_one_model_and_shares_of_the_data(cracks):
    curves, sizes, energies, _ = models.figure_5(comparison(["M1-concat"]), cracks, efficiency()).axes
    assert curves.lines[0].get_ydata().tolist() == HISTORY["validation_mse"]
    assert curves.lines[1].get_xydata().tolist() == [[2.0, 0.1]]
    assert sizes.lines[-1].get_xydata().tolist() == [[100.0, 2e-2]]
    by_label = {line.get_label(): line.get_xydata() for line in energies.lines}
    assert by_label["Persson-Brener"].tolist() == [[0.1, 1.0], [10.0, 5.0]]
    assert by_label["solver"][3].tolist() == [4.0, 2.2]
    assert by_label["solver, own velocity"][3].tolist() == pytest.approx([4.4, 2.2])
    assert by_label["M1-concat"][3].tolist() == [4.0, 2.3]
    assert "1.25 %" in energies.get_title(loc="right")
    shares = models.figure_5(comparison(names()), cracks, efficiency()).axes[3]
    points = shares.containers[0].lines[0].get_xydata()
    np.testing.assert_allclose(points, [[12.5, 1.0 / 12.5], [25.0, 0.04], [75.0, 1.0 / 75.0]])
    assert shares.containers[0].get_label() == "mean of 1 or 2 folds"
    assert [100.0, 5e-3] in [line.get_xydata()[0].tolist() for line in shares.lines]


def test_figures_of_curves_name_what_they_cannot_compare_and_draw_sets_and_shares():
    for axes in models.figure_learning_curves(comparison(names())).axes:
        assert [line.get_label() for line in axes.lines[::2]] == list(FAMILIES)
    trained = ["M1-concat", "M1-FiLM", "M4-gated"]
    for old, lines in ((trained[1:], [0, 0]), (trained[1:2], [0, 2]), (trained[2:], [2, 0])):
        drawn = models.figure_learning_curves(outdated(comparison(trained), *old))
        assert [len(axes.lines) for axes in drawn.axes] == lines
        assert "trained with another recipe: " in drawn.get_supxlabel()
    sets = {name: {"validation_mse": 0.1, "mse": 0.2, "history": HISTORY} for name in "ABCD"}
    first, second = features.figure_features({"sets": sets}, efficiency())["figure-features"].axes
    assert len(first.lines) == 8
    assert first.lines[1].get_xydata().tolist() == [[2.0, 0.1]]
    assert [line.get_label() for line in second.lines[::2]] == ["100 %", "75 %", "25 %", "12.5 %"]


SEEDS = {"M1-concat": 3, "M1-gated": 2, "M2-concat": 1}
NOTE = "median, least and largest of 3 or 2 or 1 seeds each"


def whiskers(axes):
    """Ends of the vertical error bars, by their place."""
    segments = [line for bars in axes.containers for group in bars.lines[2] for line in group.get_segments()]
    return {float(line[0][0]): sorted(line[:, 1].tolist()) for line in segments if line[0][0] == line[1][0]}


def test_several_seeds_are_medians_with_whiskers_and_learning_curves_in_a_band(cracks):
    found, spread = comparison(names()), ranking(SEEDS)
    kept = models.figure_mse_mae(found, spread), models.figure_5(found, cracks, efficiency(), spread)
    for axes, x, y, single in (
        (kept[0].axes[0], "test_mse", "test_mae", [3e-3, 3e-2]),
        (kept[1].axes[1], None, "test_dtw_rmse", None),
    ):
        plotted = {
            line.get_label(): line.get_xydata()[0].tolist() for line in axes.lines if line.get_label() in names()
        }
        assert list(plotted) == names()
        ends = whiskers(axes)
        assert len(ends) == 2
        for name in ("M1-concat", "M1-gated"):
            one = spread["spread"][name]
            assert plotted[name][1] == one[y]["median"]
            assert x is None or plotted[name][0] == one[x]["median"]
            assert ends[plotted[name][0]] == pytest.approx([one[y]["min"], one[y]["max"]])
        # One seed beside the published training is no spread.
        assert single is None or plotted["M1-FiLM"] != plotted["M2-concat"]
        assert x is None or plotted["M2-concat"][0] == comparison(names())["models"]["M2-concat"]["mse"]
    for drawn in kept:
        assert drawn.get_supxlabel() == NOTE
    found, spread = comparison(names()), ranking(SEEDS)
    kept = models.figure_5(found, cracks, efficiency(), spread), models.figure_learning_curves(found, spread)
    for axes, name in ((kept[0].axes[0], "M1-concat"), (kept[1].axes[1], "M1-gated")):
        (band,) = axes.collections
        curves = np.array(spread["curves"][name])
        heights = band.get_paths()[0].vertices[:, 1]
        assert (heights.min(), heights.max()) == (curves.min(), curves.max())
        assert axes.lines[0].get_ydata().tolist() == pytest.approx(np.median(curves, axis=0).tolist())
        assert axes.lines[1].get_xdata().tolist() == [2]
        assert axes.lines[2].get_ydata().tolist() == HISTORY["validation_mse"]
    assert not kept[1].axes[0].collections


def test_features_of_several_seeds_are_bands_and_rows():
    sets = {name: {"validation_mse": 0.1, "mse": 0.2, "history": HISTORY} for name in "ABCD"}
    spread = ranking({"features-C": 2, "features-D": 1})
    figure, table = features.figure_features({"sets": sets}, efficiency(), spread).values()
    labels = [line.get_label() for line in figure.axes[0].lines[::2]]
    assert [label[0] for label in labels] == list("ABCD")
    assert labels[2].endswith("(1.0e-04 to 1.2e-04, 2 seeds)")
    assert labels[3].endswith("(1.0e-01)")
    rows = table.rows
    assert [row[2:4] for row in rows] == [["uniform", "1"], ["uniform", "1"], ["uniform", "2"], ["uniform", "1"]]
    assert rows[0][4:] == ["0.1", "0.2", "-", "-"]
    assert rows[2][4:6] == ["6.00e-05 (5.00e-05 to 6.00e-05)"] * 2


def test_every_seed_is_a_point_and_every_interval_a_bar():
    seeds = dict.fromkeys(names(), 3)
    content = ranking(seeds)
    # The study of the inputs is not drawn, so that its larger errors do not widen the axes.
    content["spread"]["features-A"] = {metric: {"min": 1e3, "max": 1e3} for metric in rankings.SHOWN}
    drawn = rankings.figure_ranking(content, comparison(names(), by_recipe=["M2-FiLM"]))
    for axes, metric in zip(drawn.axes, rankings.SHOWN, strict=True):
        assert axes.get_yscale() == "log"
        points = {line.get_label(): line for line in axes.lines if line.get_label() in seeds}
        assert list(points) == names()
        (theirs,) = [line for line in axes.lines if line.get_markeredgecolor() == drawing.BLACK]
        assert theirs.get_color() == models_style.color("M2-FiLM")
        for name, line in points.items():
            assert line.get_ydata().tolist() == [row[metric] for row in content["models"][name]]
            assert line.get_color() == models_style.color(name)
        bars = [(bar.get_y(), bar.get_y() + bar.get_height()) for bar in axes.patches]
        low, high = axes.get_ylim()
        ends = [content["spread"][name][metric] for name in names()]
        assert bars == [pytest.approx((one["low"], one["high"])) for one in ends]
        assert low < min(bar[0] for bar in bars) < max(bar[1] for bar in bars) < high < 1e3
        assert not axes.texts
    assert drawn.get_supxlabel() == ""


def test_tables_and_what_is_made_without_any_seed():
    trained = comparison(["M1-concat"])
    rankings.figure_ranking(ranking({}), trained).draw_without_rendering()
    assert rankings.table_ranking(ranking({}), trained)["ranking"].rows == []
    content = ranking({"M1-concat": 3, "M2-concat": 1})
    content["left_out"] = {"M3-FiLM/seed-0": "left out, because"}
    content["spread"]["M1-concat"]["validation_mse"] = {"median": 0.007}
    first, second = rankings.table_ranking(content, comparison(["M1-concat"], by_recipe=["M1-concat"])).values()
    rows = first.rows
    assert rows[0][:4] == ["M1-concat", "0.002", "3 of 3", "6.00e-05 [4.80e-05, 7.80e-05], seeds 5.00e-05 to 7.00e-05"]
    assert rows[0][-1] == "0.007"
    assert rows[1][:4] == ["M2-concat", "-", "1 of 3", "1.00e-04 [8.00e-05, 1.30e-04]"]
    assert len(rows) == 2
    assert "M3-FiLM/seed-0 is left out, because." in first.caption
    assert second.rows == [
        ["best model", "M1-concat first", "2 of 3", "-", "not decided"],
        ["", "M1-concat before M2-concat", "3 and 3", "0.500", "tie"],
        ["", "M1-concat before M3-concat", "3 and 3", "> 0.999", "holds"],
    ]


def hidden_errors(factor):
    levels = {"p50": 1.0 * factor, "p90": 3.0 * factor, "p99": 9.0 * factor}
    return {"count": 10, **dict.fromkeys(features.READINGS, levels)}


def trained_on(mse, factor=None):
    one = {"validation_mse": mse, "mse": 2.0 * mse, "history": HISTORY}
    return one if factor is None else one | {"hidden": hidden_errors(factor)}


CONTENT = {
    "command": "python -m experiments feature_sets",
    "config": {"sets": ["A", "D", "E", "F"], "physical": ["D", "F"]},
    "sets": {"A": trained_on(0.8), "D": trained_on(0.4, 0.8), "E": trained_on(0.3, 0.7), "F": trained_on(0.1, 0.4)},
    "physical": {"D": trained_on(0.6, 0.2), "F": trained_on(0.2, 0.1)},
    "floor": {"uniform": hidden_errors(0.05), "physical": hidden_errors(0.01)},
}


def test_models_are_compared_across_steps_beside_the_solvers_own_forces():
    curves, _, pull_off, hysteresis = features.figure_features(CONTENT, efficiency())["figure-features"].axes
    # Curves at physical steps have hidden_errors of other forces.
    assert [line.get_label()[0] for line in curves.lines[::2]] == list("ADEF")
    for axes in (pull_off, hysteresis):
        assert [tick.get_text() for tick in axes.get_xticklabels()] == ["solver's\nforces", "D", "E", "F"]
        marks = [line for line in axes.lines if line.get_marker() != "None"]
        assert [line.get_ydata()[0] for line in marks] == pytest.approx([0.05, 0.8, 0.7, 0.4, 0.01, 0.2, 0.1])
        assert [round(line.get_xdata()[0]) for line in marks] == [0, 1, 2, 3, 0, 1, 3]
        bars = [line.get_ydata().tolist() for line in axes.lines if line.get_marker() == "None"]
        assert bars[1] == pytest.approx([0.8, 2.4])
    words = [text.get_text() for text in pull_off.get_legend().get_texts()]
    assert words == ["uniform steps", "physical steps"]
    colors = {line.get_color() for line in marks[:4]}, {line.get_color() for line in marks[4:]}
    assert [len(found) for found in colors] == [1, 1]
    assert colors[0] != colors[1]


def test_the_table_has_a_row_for_each_set_and_kind_of_steps():
    rows = features.figure_features(CONTENT, efficiency())["features"].rows
    floor = ["", ""]
    assert [[row[0], row[2]] for row in rows] == [
        *([name, "uniform"] for name in "ADEF"),
        *([name, "physical"] for name in "DF"),
        *(["", kind] for kind in ("uniform", "physical")),
    ]
    assert [row[3] for row in rows] == ["1"] * 6 + floor
    assert rows[0][4:] == ["0.8", "1.6", "-", "-"]
    assert rows[4][4:] == ["0.6", "1.2", "0.2, 0.6, 1.8", "0.2, 0.6, 1.8"]
    assert rows[6][4:] == ["", "", "0.05, 0.15, 0.45", "0.05, 0.15, 0.45"]
    content = CONTENT | {"sets": {"A": trained_on(0.8)}, "physical": {}, "floor": {}}
    rows = features.features_table(content).rows
    assert [(row[0], row[2], row[3]) for row in rows] == [
        ("A", "uniform", "1"),
        *((name, "uniform", "0") for name in "DEF"),
        *((name, "physical", "0") for name in "DF"),
    ]
    text = features.page_text(CONTENT | {"physical": {"D": trained_on(0.6, 0.2)}})
    assert "Not all of these are trained yet: `make feature-sets`." in text
