import numpy as np
import pytest

from bem._support.validation import finite_number, finite_vector, real_array
from bem._support.wording import shortened, shown


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, "3", None, True, 1j, [1.0], 10**400, ["x" * 10**7]])
def test_only_finite_real_numbers_pass(value):
    with pytest.raises(ValueError, match="must be a finite number; received") as error:
        finite_number("x", value)
    assert len(str(error.value)) < 500


@pytest.mark.parametrize("value", [3, 3.0, np.float32(3), np.int64(3)])
def test_any_real_type_becomes_a_float(value):
    assert type(finite_number("x", value, low=3.0, high=3.0)) is float
    for bound in ({"low": 3.1}, {"high": 2.9}, {"above": 3.0}, {"below": 3.0}):
        with pytest.raises(ValueError, match=r"received .*3"):
            finite_number("x", value, **bound)


def test_vectors_are_read_only_copies():
    source = np.array([1.0, 2.0])
    vector = finite_vector("x", source)
    source[0] = 5.0
    assert vector[0] == 1.0
    assert not vector.flags.writeable


@pytest.mark.parametrize("values", [[1.0, np.nan], [[1.0]], "ab", [], ["a", "b"], 3.0, [1j, 2.0], np.array([1j])])
def test_bad_vectors(values):
    with pytest.raises(ValueError, match="x must be a one-dimensional sequence of at least 1 finite numbers; received"):
        finite_vector("x", values, at_least=1)


def nested(depth):
    return [nested(depth - 1)] if depth else []


class Rude:
    def __repr__(self):
        raise RuntimeError("no")


@pytest.mark.parametrize(
    "value",
    [
        "x" * 10**6,
        "a\n\nb",
        ["y" * 1000] * 1000,
        nested(300),
        [10**5000],
        np.arange(10**6),
        {1: ["z" * 10**5] * 9},
        Rude(),
    ],
)
def test_shown_value_is_one_short_line(value):
    assert 0 < len(shown(value)) <= 310
    assert "\n" not in shown(value)


def test_what_is_short_is_shown_as_it_is():
    assert [shown(value) for value in ("a b", 2.5, [1, 2], None)] == ["'a b'", "2.5", "[1, 2]", "None"]
    assert shortened("a\n b") == "a b"
    assert shortened("0123456789", 4) == "01 ... 89"


@pytest.mark.parametrize("values", [1, [True, 2.5], np.float32(3.0), [10**30, 1], np.array([1, 2], dtype=object)])
def test_real_numbers_become_float64(values):
    assert real_array("x", values).dtype == np.float64


@pytest.mark.parametrize(
    "values", [1j, [1.0, 1j], np.array([1j], dtype=object), "1", ["1"], [[1], [2, 3]], [10**400, 1], {}]
)
def test_other_values_are_no_real_numbers(values):
    with pytest.raises(ValueError, match="x must be real numbers; received"):
        real_array("x", values)
