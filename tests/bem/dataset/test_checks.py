"""Numbers that no whole data set holds are named, each by its array."""

import numpy as np
import pytest

from bem.dataset.checks import column_fault
from bem.dataset.file import load_dataset


@pytest.fixture
def dataset(undisturbed):
    found = load_dataset(undisturbed, native=True)
    found.columns.update({name: np.array(values) for name, values in found.columns.items()})
    return found


def fault(dataset):
    return column_fault(dataset.columns, dataset.attributes["campaign"], dataset.counts)


def test_a_whole_data_set_has_no_fault(dataset):
    assert fault(dataset) == ""


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("fms/force", np.nan, "whose /fms/force is not finite in every completed trajectory"),
        ("scalars/hysteresis", np.inf, "whose /scalars/hysteresis is not finite in every completed trajectory"),
        ("protocols/tabor", 0.0, "whose /protocols/tabor is not above zero"),
        ("protocols/dwell_time", -1.0, "whose /protocols/dwell_time is below zero"),
        ("protocols/peak_indentation", np.nan, "whose /protocols/peak_indentation is not finite"),
    ],
)
def test_a_number_out_of_range_is_named(dataset, name, value, words):
    dataset.columns[name][3] = value
    assert fault(dataset) == words
