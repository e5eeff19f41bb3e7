"""The Keras backend: its start, its threads, its versions, and whether it has a fused LSTM."""

from __future__ import annotations

import importlib
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager


def limit_threads(threads: int) -> None:
    """Limit the number of threads of the backend; effective only before keras is imported.

    Raises:
        ValueError: fewer than one thread.
        RuntimeError: keras is imported already.
    """
    if threads < 1:
        raise ValueError(f"Expected at least one thread. Received: threads={threads}")
    if "keras" in sys.modules:
        raise RuntimeError("Threads must be limited before keras is imported")
    for variable in ("OMP_NUM_THREADS", "TF_NUM_INTRAOP_THREADS", "TF_NUM_INTEROP_THREADS"):
        os.environ[variable] = str(threads)
    if threads == 1:
        flags = os.environ.get("XLA_FLAGS", "")
        os.environ["XLA_FLAGS"] = f"{flags} --xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1".strip()


def import_keras() -> None:
    """Import Keras and its backend silently; call this before any other use of Keras.

    What they write to the standard error as they start is shown when the import fails, or where the environment sets
    `TF_CPP_MIN_LOG_LEVEL=0`.

    Raises:
        ModuleNotFoundError: Keras or its backend is not installed.
    """
    if "keras" in sys.modules:
        return
    # Libraries of TensorFlow write messages before they read this variable.
    if os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3") == "0":
        importlib.import_module("keras")
        return
    with silent_stderr():
        importlib.import_module("keras")


@contextmanager
def silent_stderr() -> Iterator[None]:
    """Hold back the standard error of this process, libraries in C included; show it after an error."""
    try:
        shown = os.dup(2)
    except OSError:  # there is none
        yield
        return
    with tempfile.TemporaryFile() as held:
        os.dup2(held.fileno(), 2)
        try:
            yield
        except BaseException:
            os.dup2(shown, 2)
            held.seek(0)
            os.write(2, held.read())
            raise
        finally:
            os.dup2(shown, 2)
            os.close(shown)


def has_fused_lstm() -> bool:
    """Tell whether an LSTM trains as one fused kernel here rather than step by step.

    Under PyTorch it always does, see `surrogate.training.torch_lstm`. Under other backends Keras checks arguments and
    device in a private function. This function calls it, and returns False where it is missing.
    """
    import keras

    if keras.backend.backend() == "torch":
        return True
    try:
        module = importlib.import_module(f"keras.src.backend.{keras.backend.backend()}.rnn")
        # Compared as functions, not by name.
        tanh, sigmoid = keras.activations.tanh, keras.activations.sigmoid
        return bool(module.cudnn_ok(tanh, sigmoid, unroll=False, use_bias=True))
    except (ImportError, AttributeError, TypeError):
        return False


def versions() -> dict[str, str]:
    """Return the versions that decide what a training run computes, by name."""
    import platform

    import keras
    import numpy as np

    backend = keras.backend.backend()
    found = {"python": platform.python_version(), "keras": keras.__version__, "numpy": np.__version__}
    if backend != "numpy":
        found[backend] = importlib.import_module(backend).__version__
    return found
