"""Settings of the solver's unit tests."""

import pytest
from threadpoolctl import threadpool_limits


@pytest.fixture(scope="session", autouse=True)
def one_blas_thread():
    """Kernels tried without `simulate` want what it gives them: systems this small only suffer from threads."""
    with threadpool_limits(limits=1, user_api="blas"):
        yield
