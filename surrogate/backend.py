"""The Keras backend: its start, its threads and its versions."""

from __future__ import annotations

import importlib
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager


def limit_threads(threads: int) -> None:
    """Limit the number of threads of the backend. This has an effect only before Keras is imported.

    Raises:
        ValueError: the number of threads is below one.
        RuntimeError: Keras is already imported.
    """
    if threads < 1:
        raise ValueError(f"threads must be at least 1; received {threads}")
    if "keras" in sys.modules:
        raise RuntimeError("threads must be limited before Keras is imported; received a limit after the import")
    for variable in ("OMP_NUM_THREADS", "TF_NUM_INTRAOP_THREADS", "TF_NUM_INTEROP_THREADS"):
        os.environ[variable] = str(threads)
    if threads == 1:
        flags = os.environ.get("XLA_FLAGS", "")
        os.environ["XLA_FLAGS"] = f"{flags} --xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1".strip()


def import_keras() -> None:
    """Import Keras and its backend without their messages; call this before any other use of Keras.

    The messages on standard error are shown if the import fails, or if the environment sets `TF_CPP_MIN_LOG_LEVEL=0`.

    Raises:
        ModuleNotFoundError: Keras or its backend is not installed.
    """
    if "keras" in sys.modules:
        return
    # TensorFlow's libraries write some messages before they read this variable, so standard error is held back, too.
    if os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3") == "0":
        importlib.import_module("keras")
        return
    with silent_stderr():
        importlib.import_module("keras")


@contextmanager
def silent_stderr() -> Iterator[None]:
    """Hold back the standard error of this process, also that of C libraries; show it after an exception."""
    try:
        shown = os.dup(2)
    except OSError:  # the process has no standard error
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


def versions() -> dict[str, str]:
    """Return the versions of Python, Keras, NumPy and the backend, by name."""
    import platform

    import keras
    import numpy as np

    backend = keras.backend.backend()
    installed = {"python": platform.python_version(), "keras": keras.__version__, "numpy": np.__version__}
    if backend != "numpy":
        installed[backend] = importlib.import_module(backend).__version__
    return installed
