import pytest
import typer

from bem.dataset.file import load_dataset
from paper_figures.figures import figure_2
from paper_figures.report import data_card
from paper_figures.style import drawing
from tests.processes import ROOT
from tools import fill

HOURS = "<!-- fill paper_figures.report.data_card.paper_hours -->"


@pytest.mark.parametrize(("before", "after"), [("", ""), ("\n\n", "\n\n"), ("\n", "\n")])
def test_places_are_filled_and_stay_places(before, after):
    text = f"a {HOURS}{before}?{after}<!-- end --> b {HOURS}? or\n?<!-- end -->"
    once = fill.filled(text)
    assert once == f"a {HOURS}{before}478{after}<!-- end --> b {HOURS}478<!-- end -->"
    assert fill.filled(once) == once


@pytest.mark.parametrize("name", ["nothing.at_all", "paper_figures.report.data_card.none", "os.getcwd"])
def test_an_unknown_place_is_refused(name):
    with pytest.raises(ValueError, match=f"received '{name}'"):
        fill.filled(f"<!-- fill {name} -->?<!-- end -->")


def test_dataset_cost_equals_figure_2():
    path = ROOT / "published/dataset.h5"
    seconds, milliseconds = float(data_card.core_seconds(path)), float(data_card.milliseconds(path))
    (drawn,) = drawing.figure(height=2.0).subplots(1, 1, squeeze=False).flat
    figure_2.draw_cost(drawn, load_dataset(path), drawing.paper_values("dataset"))
    assert any(f"here: {seconds / 60.0:.1f} min" in text.get_text() for text in drawn.texts)
    assert 1e3 * seconds / int(data_card.trajectories(path).replace(",", "")) == pytest.approx(milliseconds, rel=0.05)


def test_fill_place_names_its_files(tmp_path, monkeypatch):
    monkeypatch.setattr(fill, "ROOT", tmp_path)
    line = "<!-- fill experiments.measurements.limits.contact_text a/measurements/limits.json -->{}<!-- end -->"
    with pytest.raises(FileNotFoundError, match="`make measure-limits` makes it"):
        fill.filled(line.format("?"))
    (tmp_path / "a" / "measurements").mkdir(parents=True)
    (tmp_path / "a" / "measurements" / "limits.json").write_text('{"in_contact": 0.5}', encoding="utf-8")
    assert "up to $\\mu = 0.50$<!-- end -->" in fill.filled(line.format("?"))


def test_documents_are_up_to_date(tmp_path, monkeypatch, capsys):
    assert {"README.md", "reproducing.md", "reproducibility.md", "cost.md"} <= {path.name for path in fill.documents()}
    monkeypatch.chdir(tmp_path)
    fill.main(check=True)
    copy = tmp_path / "README.md"
    stale = (ROOT / copy.name).read_text(encoding="utf-8").replace("best of 18 models", "best model")
    copy.write_text(stale, encoding="utf-8")
    with pytest.raises(typer.Exit) as end:
        fill.main([copy], check=True)
    assert (end.value.exit_code, copy.read_text(encoding="utf-8")) == (1, stale)
    *_, last = capsys.readouterr().err.splitlines(keepends=True)  # the first call may say that kernels are compiled
    assert last == f"fill: {copy} is out of date; run `python tools/fill.py {copy}`\n"
    fill.main([copy])
    assert copy.read_text(encoding="utf-8") == (ROOT / copy.name).read_text(encoding="utf-8")
