import types

import numpy as np
import pytest

from bem.dataset.designs import PAPER_RANGES
from bem.dataset.file import load_dataset
from experiments.paper.dataset_statistics import statistics
from paper_figures.__main__ import save
from paper_figures.figures import figure_2, figure_3
from paper_figures.style import drawing
from paper_figures.style.writing import Table, number
from paper_figures.tables import table_protocols_dataset


@pytest.mark.slow
def test_figure_files_are_reproducible(dataset_path, examples, tmp_path):
    for run in "ab":
        save(figure_2.compose(examples, dataset_path), tmp_path / run / "figure-2.pdf")
    first, second = ({path.name: path.read_bytes() for path in (tmp_path / run).iterdir()} for run in "ab")
    assert first == second
    assert first.keys() == {"figure-2.pdf", "figure-2.png"}


def test_histograms_and_cost_of_completed(dataset_path, examples):
    panels = figure_2.compose(examples, dataset_path).axes
    assert len(panels) == 9
    for axes in panels[6:]:
        assert axes.get_xscale() == "log"
        np.testing.assert_allclose(sum(patch.get_height() for patch in axes.patches), 1.0)
    texts = " ".join(text.get_text() for text in panels[8].texts)
    assert "paper: 478 h\nmean 138 s" in texts
    axes = drawing.figure(height=2.0).subplots()
    seconds = {"solver_seconds": np.array([30.0, 90.0, 9e3])}
    dataset = types.SimpleNamespace(scalars=seconds, completed=np.array([0, 1]))
    figure_2.draw_cost(axes, dataset, {"cpu_hours": 478, "trajectories": 12_450})
    assert "here: 2.0 min\nmean 60000.0 ms" in [text.get_text() for text in axes.texts]


def test_figure_2_shows_the_data_set(dataset_path, examples):
    panels, example = figure_2.compose(examples, dataset_path).axes, examples["examples"][0]
    first = panels[0]
    histories = [line.get_xydata() for line in first.lines if len(line.get_xdata()) > 2]
    native = np.stack([example["native"][name] for name in ("time", "force")], axis=1)
    assert len(histories) == 1
    np.testing.assert_array_equal(histories[0], native)
    marks = {line.get_label(): line.get_xydata()[0].tolist() for line in first.lines if len(line.get_xdata()) == 1}
    assert marks[r"$\hat P_\mathrm{po}$"] == [1.2345, 1.2345]
    assert marks[r"$\hat P_\mathrm{mc}$"] == native[native[:, 1].argmin()].tolist()
    data = load_dataset(dataset_path)
    times = data.scalars["pull_off_time"][data.completed]
    low, high = np.floor(np.log10(times.min())), np.ceil(np.log10(times.max()))
    edges = np.logspace(low, high, round(figure_2.BINS_PER_DECADE * (high - low)) + 1)
    bars = panels[6].patches
    np.testing.assert_allclose([bar.get_x() for bar in bars], edges[:-1])
    shares = np.histogram(times, edges)[0] / len(times)
    np.testing.assert_allclose([bar.get_height() for bar in bars], shares, atol=1e-12)
    marked = [line for line in panels[8].lines if line.get_color() == drawing.PAPER]
    assert [line.get_xdata()[0] for line in marked] == pytest.approx([3600.0 * 478 / 12_450])


def test_figure_3_shows_measurement_steps(examples):
    mapping = examples["mapping"]
    by_letter = {axes.get_title(loc="left").strip("()"): axes for axes in figure_3.compose(examples).axes}
    for letter, quantity in (("c", "indentation"), ("d", "time"), ("e", "force")):
        phases = [line for line in by_letter[letter].lines if line.get_marker() == "."]
        assert [len(line.get_xdata()) for line in phases] == [50, 20, 50]
        assert [line.get_color() for line in phases] == list(drawing.PHASES.values())
        assert np.concatenate([line.get_xdata() for line in phases]).tolist() == list(range(1, 121))
        plotted = np.concatenate([line.get_ydata() for line in phases])
        np.testing.assert_array_equal(plotted, mapping["steps"][quantity])
    for letter, quantity in (("a", "indentation"), ("b", "force")):
        phases = [line for line in by_letter[letter].lines if line.get_marker() == "None"]
        assert [line.get_color() for line in phases] == list(drawing.PHASES.values())
        drawn = np.unique(np.concatenate([line.get_xydata() for line in phases]), axis=0)
        native = np.unique(np.stack([mapping["native"][name] for name in ("time", quantity)], axis=1), axis=0)
        np.testing.assert_array_equal(drawn, native)


def test_tables_of_the_data_set(dataset_path, examples):
    numbers = statistics(load_dataset(dataset_path)) | {"with_jumps": 0.125}
    first, second = table_protocols_dataset.compose(examples, numbers).values()
    assert len(first.rows) == 6
    assert first.rows[0][:6] == ["(a)", "2", "1", "3", "1.5", "5"]
    summary = second.page()
    for text in (
        "478 CPU-hours",
        "| 12450 ",
        "resolution floor",
        "| trajectories with a jump | not stated | 12.5 % |",
    ):
        assert text in summary


def test_latex_escapes_text_but_not_formulas(tmp_path):
    Table(["A_b", r"$x_1$ (%)"], [["1 & 2", "1.20e-05"]], "50 % of $y_2$").save("t", tmp_path)
    text = (tmp_path / "t.tex").read_text(encoding="utf-8")
    assert r"A\_b & $x_1$ (\%) \\" in text
    assert r"1 \& 2 & $1.20\times10^{-5}$ \\" in text
    assert r"\caption{50 \% of $y_2$}" in text
    Table(["n"], [["1"], ["2"]], "Two.").save("t", tmp_path)
    for suffix in ("md", "csv", "tex"):
        text = (tmp_path / f"t.{suffix}").read_text(encoding="utf-8")
        assert text.rindex("1") < text.rindex("2")


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (1000.0, "1000"), (0.00888, "0.00888"), (1.23e-7, "1.23e-07"), (98765.4, "98800"), (-2.5, "-2.5")],
)
def test_numbers(value, text):
    assert number(value) == text


def test_paper_values_are_the_designs():
    paper = drawing.paper_values("dataset")
    assert (paper["trajectories"], paper["cpu_hours"]) == (12_450, 478)
    for name in PAPER_RANGES.keys() - {"peak_indentation"}:
        assert tuple(paper["ranges"][name]) == PAPER_RANGES[name]
