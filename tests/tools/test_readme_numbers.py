import importlib.util
from pathlib import Path

import pytest

from bem.dataset.file import load_dataset
from paper_figures.figures import figure_2
from paper_figures.style import drawing

PATH = Path(__file__).resolve().parents[2] / "tools/readme_numbers.py"
specification = importlib.util.spec_from_file_location("readme_numbers", PATH)
readme_numbers = importlib.util.module_from_spec(specification)
specification.loader.exec_module(readme_numbers)


def test_places_are_filled_and_stay_places():
    once = readme_numbers.filled("a <!-- count -->?<!-- end --> b", {"count": "3"})
    assert once == "a <!-- count -->3<!-- end --> b"
    assert readme_numbers.filled(once, {"count": "4"}) == "a <!-- count -->4<!-- end --> b"


def test_the_cost_of_the_data_set_is_the_solvers_as_in_figure_2():
    values = readme_numbers.numbers(PATH.parents[1])
    dataset = load_dataset(PATH.parents[1] / "published/dataset.h5")
    (drawn,) = drawing.figure(height=2.0).subplots(1, 1, squeeze=False).flat
    figure_2.draw_cost(drawn, dataset, drawing.paper_values("dataset"))
    assert any(f"here: {values['core-minutes']} min" in text.get_text() for text in drawn.texts)
    each = 1e3 * 60.0 * float(values["core-minutes"]) / int(values["trajectories"].replace(",", ""))
    assert each == pytest.approx(float(values["milliseconds"]), rel=0.05)


def test_an_unknown_place_is_refused():
    with pytest.raises(ValueError, match="received 'other'"):
        readme_numbers.filled("<!-- other -->?<!-- end -->", {"count": "3"})
