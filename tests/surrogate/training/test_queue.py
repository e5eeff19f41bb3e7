"""How a training is asked to stop; `tests/surrogate/cli/test_app.py` runs the queue."""

import signal

import pytest

from surrogate.training.queue import StopRequest


@pytest.fixture
def handler():
    """The handler of SIGTERM, which a test may replace."""
    before = signal.getsignal(signal.SIGTERM)
    yield
    signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize("how", ["SIGTERM", "STOP"])
@pytest.mark.usefixtures("handler")
def test_a_signal_or_a_file_asks_to_stop_and_a_second_signal_ends_the_process(how, tmp_path):
    asked = StopRequest(tmp_path)
    assert not asked()
    if how == "STOP":
        (tmp_path / "STOP").touch()
    else:
        signal.raise_signal(signal.SIGTERM)
    assert asked()
    assert (signal.getsignal(signal.SIGTERM) is signal.SIG_DFL) == (how == "SIGTERM")
