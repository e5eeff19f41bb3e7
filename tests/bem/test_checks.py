import numpy as np
import pytest

from bem._checks import finite_number, finite_vector, instance, strictly_increasing


def test_message_names_quantity_range_and_value():
    with pytest.raises(ValueError, match=r"^tabor must be a finite number greater than 0 and at most 1; received nan$"):
        finite_number("tabor", float("nan"), above=0.0, high=1.0)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, "3", None, True, 1j, [1.0]])
def test_only_finite_real_numbers_pass(value):
    with pytest.raises(ValueError, match="must be a finite number; received"):
        finite_number("x", value)


@pytest.mark.parametrize("value", [3, 3.0, np.float32(3), np.int64(3)])
def test_any_real_type_becomes_a_float(value):
    assert type(finite_number("x", value, low=3.0, high=3.0)) is float


@pytest.mark.parametrize("bound", [{"low": 2.1}, {"high": 1.9}, {"above": 2.0}, {"below": 2.0}])
def test_bounds(bound):
    with pytest.raises(ValueError, match=r"received 2\.0"):
        finite_number("x", 2.0, **bound)


def test_vectors_are_read_only_copies():
    given = np.array([1.0, 2.0])
    vector = finite_vector("x", given)
    given[0] = 5.0
    assert vector[0] == 1.0
    assert not vector.flags.writeable


@pytest.mark.parametrize("values", [[1.0, np.nan], [[1.0]], "ab", [], ["a", "b"], 3.0])
def test_bad_vectors(values):
    with pytest.raises(ValueError, match="x must be a one-dimensional sequence of at least 1 finite numbers; received"):
        finite_vector("x", values, at_least=1)


def test_order_and_type():
    with pytest.raises(ValueError, match=r"received 2\.0 followed by 2\.0"):
        strictly_increasing("times", np.array([1.0, 2.0, 2.0]))
    with pytest.raises(ValueError, match=r"material must be one of int\(\.\.\.\), float\(\.\.\.\); received 'rubber'"):
        instance("material", "rubber", (int, float))
