import os
import subprocess
import sys

import keras
import pytest

from surrogate.backend import limit_threads, silent_stderr, versions


def test_threads_are_limited_before_keras(monkeypatch):
    with pytest.raises(ValueError, match="threads must be at least 1; received 0"):
        limit_threads(0)
    with pytest.raises(RuntimeError, match="before Keras is imported"):
        limit_threads(1)
    monkeypatch.setattr("surrogate.backend.sys.modules", {})
    monkeypatch.setattr("surrogate.backend.os.environ", environment := {"XLA_FLAGS": "--kept"})
    limit_threads(1)
    assert environment["TF_NUM_INTRAOP_THREADS"] == environment["OMP_NUM_THREADS"] == "1"
    assert environment["XLA_FLAGS"].startswith("--kept --xla_cpu_multi_thread_eigen=false")


def test_versions_name_the_backend():
    assert set(versions()) == {"python", "keras", "numpy", keras.backend.backend()}


def test_start_messages_show_on_failure_only(capfd):
    with silent_stderr():
        os.write(2, b"E0000 Unable to register cuDNN factory\n")
    assert capfd.readouterr().err == ""

    def fails():
        with silent_stderr():
            os.write(2, b"no such library\n")
            raise ImportError

    with pytest.raises(ImportError):
        fails()
    os.write(2, b"heard again\n")
    assert capfd.readouterr().err == "no such library\nheard again\n"


@pytest.mark.slow
@pytest.mark.parametrize("way", ["surrogate.build('M3-concat')", "surrogate.cli.app.import_keras()"])
def test_the_backend_starts_silently(way):
    environment = {name: value for name, value in os.environ.items() if name != "TF_CPP_MIN_LOG_LEVEL"}
    code = f"import surrogate, surrogate.cli.app; {way}"
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")
