"""The figure and the tables of the ranking, from small made-up results."""

import pytest

from paper_figures.models import figure_ranking
from paper_figures.style import models_style
from paper_figures.tables import table_ranking
from surrogate.architectures.naming import paper_names
from tests.paper_figures.results import comparison, ranking


def test_seeds_are_ticks_and_intervals_bars():
    seeds = dict.fromkeys(reversed(paper_names()), 3)
    study = ranking(seeds)  # the last of the paper's models errs least
    study["claims"]["best_model"]["level"] = ["M6-gated", "M6-FiLM"]
    # The study of the inputs is not drawn, so that its larger errors do not widen the axes.
    study["spread"]["features-A"] = {metric: {"min": 1e3, "max": 1e3} for metric in figure_ranking.SHOWN}
    drawn = figure_ranking.compose(study, comparison(paper_names(), by_recipe=["M2-FiLM"]))
    for axes, metric in zip(drawn.axes, figure_ranking.SHOWN, strict=True):
        assert axes.get_xscale() == "log"
        points = {line.get_label(): line for line in axes.lines if line.get_label() in seeds}
        assert list(points) == list(seeds)
        (theirs,) = [line for line in axes.lines if line.get_marker() == "o"]
        assert theirs.get_markeredgecolor() == models_style.color("M2-FiLM")
        assert theirs.get_ydata().tolist() == [list(seeds).index("M2-FiLM")]
        for row, (name, line) in enumerate(points.items()):
            assert line.get_xdata().tolist() == [seed[metric] for seed in study["models"][name]]
            assert set(line.get_ydata()) == {row}
            assert line.get_color() == models_style.color(name)
        bars = [(bar.get_x(), bar.get_x() + bar.get_width()) for bar in axes.patches]
        low, high = axes.get_xlim()
        ends = [study["spread"][name][metric] for name in seeds]
        assert bars == [pytest.approx((interval["low"], interval["high"])) for interval in ends]
        assert low < min(bar[0] for bar in bars) < max(bar[1] for bar in bars) < high < 1e3
    labels = drawn.axes[0].get_yticklabels()
    assert [label.get_text() for label in labels] == list(seeds)
    assert [label.get_text() for label in labels if label.get_fontweight() == "bold"] == ["M6-gated", "M6-FiLM"]
    texts = [text.get_text() for axes in drawn.axes for text in axes.texts]
    assert texts == ["ticks: seeds by swift", "bar: 95 % interval over the test set"]
    assert drawn.get_supxlabel() == ""


def test_ranking_tables_without_any_seed():
    trained = comparison(["M1-concat"])
    figure_ranking.compose(ranking({}), trained).draw_without_rendering()
    assert table_ranking.compose(ranking({}), trained)["ranking"].rows == []
    study = ranking({"M1-concat": 3, "M2-concat": 1})
    study["left_out"] = {"M3-FiLM/seed-0": "left out, because"}
    study["spread"]["M1-concat"]["validation_mse"] = {"median": 0.007}
    first, second = table_ranking.compose(study, comparison(["M1-concat"], by_recipe=["M1-concat"])).values()
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
