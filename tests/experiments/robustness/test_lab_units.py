"""The tables of the page on units are what the study prints."""

from pathlib import Path

from experiments.robustness import lab_units

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "units.md").read_text(encoding="utf-8")


def test_the_page_has_the_tables_that_the_study_prints():
    assert lab_units.contacts_table() in PAGE
    assert lab_units.ranges_table() in PAGE
