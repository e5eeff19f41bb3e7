"""`surrogate` with a model of a few weights in the place of M1-concat, for tests that stop such a process.

Where `WAIT_AFTER_EPOCH` is set the training waits there for the signal, however slow who sends it may be.
"""

import os
import signal
import time

import surrogate.networks
import surrogate.training.fitting
import surrogate.training.runs
from surrogate.cli.app import app_main
from tests.surrogate.conftest import build_least


def waiting(save):
    def saved(folder, progress, *rest):
        save(folder, progress, *rest)
        if progress.epoch == int(os.environ.get("WAIT_AFTER_EPOCH", 0)):
            # Who has noticed a signal lets the next one end the process.
            while signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
                time.sleep(0.01)

    return saved


if __name__ == "__main__":
    surrogate.training.runs.build = surrogate.networks.build = build_least
    surrogate.training.fitting.save_progress = waiting(surrogate.training.fitting.save_progress)
    app_main()
