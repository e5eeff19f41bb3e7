"""Every figure is fit for print: width, size of texts, no two of them on each other, colours; and tables compile."""

import shutil
import subprocess
from itertools import combinations

import pytest
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from bem.plots import COLOURS
from experiments.places import Places
from paper_figures.__main__ import function_of, modules, save
from paper_figures.style import drawing
from tests.paper_figures import printed
from tests.processes import ROOT

FIGURES = [name for name in modules() if not name.startswith("table-")]
LEAST = 6.5  # points
APART = 10.0  # in CIELAB; two patches side by side differ from about 2


@pytest.fixture(scope="module", params=FIGURES)
def drawn(request):
    """The figures of a module by name, from the results of this repository, as far as these are there."""
    function = function_of(request.param)
    try:
        results = Places(ROOT / "results", ROOT / "published").arguments(function, request.param)
    except FileNotFoundError as missing:
        pytest.skip(str(missing))
    made = function(**results)
    made = made if isinstance(made, dict) else {request.param: made}
    yield {name: figure for name, figure in made.items() if isinstance(figure, plt.Figure)}
    plt.close("all")


def test_a_figure_is_as_wide_as_a_column_or_two_and_readable(drawn):
    for name, figure in drawn.items():
        assert round(figure.get_figwidth() * printed.MILLIMETRES) in (88, 180), name
        assert {text.get_text(): text.get_fontsize() for text in printed.texts(figure, below=LEAST)} == {}, name


def test_no_text_lies_on_another_or_leaves_the_figure(drawn):
    for name, figure in drawn.items():
        assert printed.overlaps(figure) == [], name


def test_colours_that_a_legend_tells_apart_differ_for_every_eye(drawn):
    for name, figure in drawn.items():
        alike = {
            (first, second)
            for named in printed.colors(figure)
            for first, second in combinations(named, 2)
            if named[first] != named[second] and printed.distance(named[first], named[second]) < APART
        }
        assert alike == set(), name


def test_every_tool_has_a_colour_of_its_own():
    assert len(set(COLOURS.values())) == len(COLOURS)


@pytest.mark.parametrize(("largest", "between"), [(50.0, True), (1e5, False)])
def test_only_a_short_logarithmic_axis_has_ticks_between_powers_of_ten(largest, between):
    axes = drawing.figure(height=2.0).subplots()
    axes.set(xscale="log", xlim=(1.0, largest))
    drawing.log_labels(axes.xaxis)
    ticks = axes.get_xticks()
    assert 10.0 in ticks
    assert ({2.0, 5.0} <= set(ticks)) == between


PACKAGES = r"\usepackage[textwidth=180mm]{geometry}\usepackage{booktabs,tabularx}"
HEAD = rf"\documentclass[a4paper]{{article}}{PACKAGES}\begin{{document}}"


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="LaTeX is not installed")
def test_the_tables_compile_within_the_width_of_the_text(tmp_path, monkeypatch):
    monkeypatch.setattr("paper_figures.style.drawing.save", lambda *_: None)
    for name in modules():
        try:
            composed = function_of(name)
            results = Places(ROOT / "results", ROOT / "published").arguments(composed, name)
        except FileNotFoundError:
            continue
        if name != "figure-architectures" and composed.__annotations__["return"] is not Figure:
            save(composed(**results), name, tmp_path, tmp_path)
    names = sorted(path.stem for path in tmp_path.glob("*.tex"))
    assert len(names) > 10
    body = "\n".join(rf"\input{{{name}}}\clearpage" for name in names)
    (tmp_path / "all.tex").write_text(f"{HEAD}\n{body}\n\\end{{document}}\n", encoding="utf-8")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "all.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, errors="replace", check=False)
    assert done.returncode == 0, done.stdout[-2000:]
    wide = [line for line in done.stdout.splitlines() if line.startswith(r"Overfull \hbox")]
    assert wide == []
