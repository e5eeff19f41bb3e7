"""Kernels that other kernels call are parts of these, with Numba's own compilation as the fall back."""

import sys

import numpy as np
import pytest

from bem._support import jit
from bem._support.jit import _Kernel


def kernels():
    """A kernel, and a part of it that returns an array."""

    def tail(values, first):
        return values[first:]

    def tails(values):
        total = 0.0
        for _ in range(100):
            total += nested(values, 1)[0] + nested(values, 2)[0]
        return total, nested(values, 1)

    nested = _Kernel(tail, cache=False)
    return nested, _Kernel(tails, cache=False)


def test_numba_version_compiles_parts():
    assert jit._try_parts()


@pytest.mark.parametrize("works", [True, False])
def test_parts_give_what_numba_gives(works, monkeypatch):
    monkeypatch.setattr(jit, "_parts_work", lambda: works)
    nested, kernel = kernels()
    values = np.arange(4.0)
    before = sys.getrefcount(values)
    total, tail = kernel(values)
    assert (total, tail.tolist()) == (300.0, [1.0, 2.0, 3.0])
    assert len(nested._part.overloads) == 1  # of two constants
    assert len(nested._whole.overloads) == 0
    del tail
    assert sys.getrefcount(values) == before


def test_failed_part_is_compiled_by_numba(monkeypatch):
    from bem._support import kernel_parts

    def broken(_):
        raise AttributeError("no such method in this version of Numba")

    monkeypatch.setattr(kernel_parts, "part_pipeline", broken)
    monkeypatch.setattr(jit, "_try_parts", jit._try_parts.__wrapped__)
    assert not jit._try_parts()
    assert kernels()[1](np.arange(4.0))[0] == 300.0
