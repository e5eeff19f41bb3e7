"""When a surrogate pays for itself, from a measured file and the paper's numbers."""

import pytest

from experiments.places import Places
from experiments.trainings import amortisation


def test_amortisation_finds_where_lines_cross(cost, dataset, tmp_path):
    content = amortisation.study(cost, dataset, tmp_path / "no models")
    crossing = next(c for c in content["break_even"] if c["solver"] == "paper's solver")
    paper = {line["name"]: line for line in content["lines"]}
    at = crossing["queries"]
    assert at * paper["paper's solver"]["query_seconds"] == pytest.approx(
        paper["paper's surrogate"]["fixed_seconds"] + at * paper["paper's surrogate"]["query_seconds"]
    )
    assert 12_450 < at < 13_000
    assert (
        amortisation.break_even(amortisation.line("dear", "", 1.0, 2.0), amortisation.line("cheap", "", 0.0, 1.0))
        is None
    )
    with pytest.raises(FileNotFoundError, match="make measure-accuracy-cost"):
        Places(published=tmp_path).arguments(amortisation.study, "amortisation")
