"""Numbers that no whole data set holds are named, each by its array."""

import numpy as np
import pytest

from bem.dataset.checks import column_fault
from bem.dataset.file import load_dataset
from bem.dataset.records import FAILED


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
        ("protocols/tabor", -1.0, "whose /protocols/tabor is not above zero"),
        ("protocols/dwell_time", -1.0, "whose /protocols/dwell_time is below zero"),
        ("protocols/peak_indentation", np.nan, "whose /protocols/peak_indentation is not finite"),
    ],
)
def test_a_number_out_of_range_is_named(dataset, name, value, words):
    dataset.columns[name][3] = value
    assert fault(dataset) == words


def test_what_failed_may_hold_no_numbers(dataset):
    dataset.columns["status"][3] = FAILED
    dataset.columns["fms/force"][3] = np.nan
    assert fault(dataset) == ""


@pytest.mark.parametrize(
    ("name", "values", "words"),
    [
        ("index", [1, 1], "whose /index does not increase from 0 to less than 120"),
        ("index", [2, 1], "whose /index does not increase from 0 to less than 120"),
        ("jumps/trajectory", [2, 1], "whose /jumps/trajectory is not in the order of /index"),
        ("native/offsets", [2, 1], "whose /native/offsets do not increase from 0"),
    ],
)
def test_what_is_out_of_order_is_named(dataset, name, values, words):
    dataset.columns[name][1:3] = values
    assert fault(dataset) == words
