"""The door in: quick to import, free of TensorFlow, and `simulate` is always the function."""

import subprocess
import sys

import pytest

import bem


def run(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


def test_import_loads_no_heavy_package():
    heavy = run("import bem, sys; print([m for m in ('tensorflow', 'keras', 'numba', 'scipy') if m in sys.modules])")
    assert heavy == "[]"


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = bem.no_such_name


def test_every_name_is_listed():
    assert set(bem.__all__) <= set(dir(bem))


def test_passive_names_are_the_objects_of_their_modules():
    from bem.protocol import LoadingProtocol
    from bem.scene import Scene

    assert bem.Scene is Scene
    assert bem.LoadingProtocol is LoadingProtocol


def test_all_public_names_resolve():
    assert all(callable(getattr(bem, name)) for name in bem.__all__)


def test_bem_needs_no_tensorflow():
    assert run("from bem import *; import sys; print('tensorflow' in sys.modules or 'keras' in sys.modules)") == "False"
