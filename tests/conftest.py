"""Settings shared by all tests."""

import os

import pytest
from hypothesis import settings

from surrogate.architectures.naming import FAMILIES

# TensorFlow, where a test starts it, is silent. All take one core: with matrices this small, threads of BLAS wait for
# each other longer than they compute.
os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
for name in ("TF_NUM_INTRAOP_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

# The first example of a kernel compiles it, and a shared machine stalls now and then: clocks prove nothing here.
settings.register_profile("steady", deadline=None, derandomize=True)
settings.load_profile("steady")

# `make test` hands these to its children, where a `make` that a test starts would print its folder or work in parallel.
for name in ("MAKEFLAGS", "MFLAGS", "MAKELEVEL"):
    os.environ.pop(name, None)


@pytest.fixture
def in_this_process(monkeypatch):
    """Campaigns without workers, whose start takes seconds, where a test asks what is kept and not who computes it."""
    from tests.bem.dataset.helpers import Here

    for module in ("run", "verification"):
        monkeypatch.setattr(f"bem.dataset.{module}.LocalExecutor", Here)


@pytest.fixture(autouse=True)
def forget_registered_architectures():
    before = dict(FAMILIES)
    yield
    FAMILIES.clear()
    FAMILIES.update(before)
