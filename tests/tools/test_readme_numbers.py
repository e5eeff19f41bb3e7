import importlib.util
from pathlib import Path

import pytest

PATH = Path(__file__).resolve().parents[2] / "tools/readme_numbers.py"
specification = importlib.util.spec_from_file_location("readme_numbers", PATH)
readme_numbers = importlib.util.module_from_spec(specification)
specification.loader.exec_module(readme_numbers)


def test_places_are_filled_and_stay_places():
    once = readme_numbers.filled("a <!-- count -->?<!-- end --> b", {"count": "3"})
    assert once == "a <!-- count -->3<!-- end --> b"
    assert readme_numbers.filled(once, {"count": "4"}) == "a <!-- count -->4<!-- end --> b"


def test_an_unknown_place_is_refused():
    with pytest.raises(ValueError, match="received 'other'"):
        readme_numbers.filled("<!-- other -->?<!-- end -->", {"count": "3"})
