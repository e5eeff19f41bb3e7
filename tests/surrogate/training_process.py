"""`surrogate` with a model of a few weights in the place of M1-concat, for tests that stop such a process."""

import surrogate.backends
import surrogate.runs
from surrogate.cli import app_main
from tests.surrogate.conftest import build_lstm

if __name__ == "__main__":
    surrogate.runs.build = surrogate.backends.build = build_lstm
    app_main()
