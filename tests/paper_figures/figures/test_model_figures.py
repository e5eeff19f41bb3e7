"""What the figures that compare models, feature sets and shares of the data plot, from small result files."""

import numpy as np
import pytest

from paper_figures.figures import figure_5, figure_features, figure_learning_curves, figure_mse_mae
from paper_figures.style import drawing, models_style
from paper_figures.tables import table_models
from surrogate.architectures.naming import FAMILIES, names
from tests.paper_figures.results import HISTORY, comparison, efficiency, made, outdated, write


def test_what_is_trained_otherwise_is_not_called_untrained(tmp_path, cracks, kept):
    found = write(tmp_path / "c.json", outdated(comparison(names()), "M2-FiLM"))
    made(figure_mse_mae, found, folder=tmp_path)
    made(figure_learning_curves, found, folder=tmp_path)
    made(figure_5, found, cracks, tmp_path / "absent.json", folder=tmp_path)
    assert {drawn.get_supxlabel() for drawn in kept} == {"trained with another recipe: M2-FiLM"}
    made(table_models, found, folder=tmp_path)
    text = (tmp_path / "models.md").read_text(encoding="utf-8")
    assert "M2-FiLM is left out: `make models` trains it anew." in text
    assert "ot trained yet" not in text


@pytest.mark.parametrize("trained", [["M1-concat"], names()], ids=["one", "all"])
def test_figure_mse_mae_plots_the_trained_and_names_the_rest(trained, tmp_path, kept):
    made(figure_mse_mae, write(tmp_path / "c.json", comparison(trained)), folder=tmp_path)
    axes = kept[0].axes[0]
    plotted = {line.get_label(): line for line in axes.lines if line.get_label() in names()}
    assert list(plotted) == trained
    assert plotted["M1-concat"].get_xydata().tolist() == [[1e-3, 1e-2]]
    assert plotted["M1-concat"].get_color() == models_style.color("M1-concat")
    paper = drawing.paper_values("reference_model")
    assert axes.lines[0].get_xydata().tolist() == [[paper["mse"], paper["mae"]]]
    note = kept[0].get_supxlabel()
    assert ("17 of 18" in note) == (len(trained) == 1)


def test_figure_5_with_one_model_and_no_data_efficiency(tmp_path, cracks, kept):
    found = write(tmp_path / "c.json", comparison(["M1-concat"]))
    made(figure_5, found, cracks, tmp_path / "absent.json", folder=tmp_path)
    curves, sizes, energies, shares = kept[0].axes
    assert curves.lines[0].get_ydata().tolist() == HISTORY["validation_mse"]
    assert curves.lines[1].get_xydata().tolist() == [[2.0, 0.1]]
    assert sizes.lines[-1].get_xydata().tolist() == [[100.0, 2e-2]]
    by_label = {line.get_label(): line.get_xydata() for line in energies.lines}
    assert by_label["Persson-Brener"].tolist() == [[0.1, 1.0], [10.0, 5.0]]
    assert by_label["solver"][3].tolist() == [4.0, 2.2]
    assert by_label["solver, own velocity"][3].tolist() == pytest.approx([4.4, 2.2])
    assert by_label["M1-concat"][3].tolist() == [4.0, 2.3]
    assert "1.25 %" in energies.get_title(loc="right")
    assert "make data-efficiency" in shares.texts[0].get_text()


def test_figure_5_data_efficiency(tmp_path, cracks, kept):
    found = write(tmp_path / "c.json", comparison(names()))
    made(figure_5, found, cracks, write(tmp_path / "e.json", efficiency()), folder=tmp_path)
    shares = kept[0].axes[3]
    points = shares.containers[0].lines[0].get_xydata()
    np.testing.assert_allclose(points, [[12.5, 1.0 / 12.5], [75.0, 1.0 / 75.0]])
    (single,) = (line for line in shares.lines if line.get_label() == "one fold")
    assert single.get_xydata().tolist() == [[25.0, 0.04]]
    assert single.get_markerfacecolor() == "white"
    assert [100.0, 5e-3] in [line.get_xydata()[0].tolist() for line in shares.lines]


def test_figure_learning_curves_needs_a_model(tmp_path, kept):
    found = write(tmp_path / "c.json", comparison(["M1-concat"]))
    with pytest.raises(FileNotFoundError, match="make models"):
        made(figure_learning_curves, found, folder=tmp_path)
    made(figure_learning_curves, write(tmp_path / "c.json", comparison(names())), folder=tmp_path)
    for axes in kept[0].axes:
        assert [line.get_label() for line in axes.lines[::2]] == list(FAMILIES)


def test_figure_learning_curves_says_so_where_no_model_may_be_compared(tmp_path, kept):
    trained = ["M1-concat", "M1-FiLM", "M4-gated"]
    for old, lines in ((trained[1:], [0, 0]), (trained[1:2], [0, 2]), (trained[2:], [2, 0])):
        found = write(tmp_path / "c.json", outdated(comparison(trained), *old))
        made(figure_learning_curves, found, folder=tmp_path)
        panels = kept[-1].axes
        assert [len(axes.lines) for axes in panels] == lines
        words = [" ".join(text.get_text() for text in axes.texts) for axes in panels]
        assert ["to compare" in text for text in words] == [not count for count in lines]
        # The empty panel's limits are its own.
        assert all(axes.get_xlim()[1] > 2.0 for axes, count in zip(panels, lines, strict=True) if count)
        assert "trained with another recipe: " in kept[-1].get_supxlabel()


def test_figure_features_draws_what_is_there(tmp_path, kept):
    absent = tmp_path / "absent.json"
    with pytest.raises(FileNotFoundError, match="make feature-sets data-efficiency"):
        made(figure_features, absent, absent, folder=tmp_path)
    sets = {name: {"validation_mse": 0.1, "history": HISTORY} for name in "ABCD"}
    made(figure_features, write(tmp_path / "f.json", {"sets": sets}), absent, folder=tmp_path)
    first, second = kept[0].axes
    assert len(first.lines) == 8
    assert first.lines[1].get_xydata().tolist() == [[2.0, 0.1]]
    assert "make data-efficiency" in second.texts[0].get_text()
    made(figure_features, absent, write(tmp_path / "e.json", efficiency()), folder=tmp_path)
    labels = [line.get_label() for line in kept[1].axes[1].lines[::2]]
    assert labels == ["100 %", "75 %", "25 %", "12.5 %"]
