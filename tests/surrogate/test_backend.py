import importlib
import os

import keras
import pytest

from surrogate.backend import has_fused_lstm, limit_threads, versions


def test_threads_are_limited_before_keras_is_imported(monkeypatch):
    with pytest.raises(ValueError, match="threads=0"):
        limit_threads(0)
    with pytest.raises(RuntimeError, match="before keras"):
        limit_threads(1)
    monkeypatch.setattr("surrogate.backend.sys.modules", {})
    monkeypatch.setattr("surrogate.backend.os.environ", environment := {"XLA_FLAGS": "--kept"})
    limit_threads(1)
    assert environment["TF_NUM_INTRAOP_THREADS"] == environment["OMP_NUM_THREADS"] == "1"
    assert environment["XLA_FLAGS"].startswith("--kept --xla_cpu_multi_thread_eigen=false")


@pytest.mark.skipif(bool(os.environ.get("CUDA_VISIBLE_DEVICES")), reason="a GPU may be in use")
def test_no_fused_lstm_on_a_processor():
    import tensorflow as tf

    assert has_fused_lstm() == bool(tf.config.list_physical_devices("GPU"))


def test_a_fused_lstm_is_recognised_where_there_is_a_gpu(monkeypatch):
    if keras.backend.backend() != "tensorflow":
        pytest.skip("TensorFlow's own question")
    # The package binds the module's name to a function.
    module = importlib.import_module("keras.src.backend.tensorflow.rnn")
    monkeypatch.setattr(module, "_is_gpu_available", lambda: True)
    assert has_fused_lstm()


def test_versions_name_the_backend():
    assert set(versions()) == {"python", "keras", "numpy", keras.backend.backend()}
