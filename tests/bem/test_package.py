"""The door in: every public name is listed and loads; `tests/test_startup.py` says what its import loads."""

import pytest

import bem


def test_every_name_is_listed_and_resolves():
    assert set(bem.__all__) <= set(dir(bem))
    assert all(callable(getattr(bem, name)) for name in bem.__all__)


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = bem.no_such_name
