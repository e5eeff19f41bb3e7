"""Architectures of a user's own that are registered, and those that are refused."""

import keras
import pytest
from keras import layers

import surrogate
from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor
from surrogate.architectures.naming import FAMILIES
from surrogate.architectures.registry import load_architectures, source_of


def build_narrow(conditioning, features, name):
    sequence, tabor = inputs(features)
    return keras.Model([sequence, tabor], readout(AppendTabor()(sequence, tabor)), name=name)


def build_otherwise(conditioning, channels):
    return None


def test_registered_family_has_names():
    surrogate.register("M7", build_narrow)
    surrogate.register("My-own.2", build_narrow, conditionings=("gated",))
    assert surrogate.names()[18:] == ["M7-concat", "M7-FiLM", "M7-gated", "My-own.2-gated"]
    assert surrogate.build("My-own.2-gated", features="A").input_shape == [(None, None, 2), (None, 1)]
    assert source_of("M7-FiLM").name == "test_registry.py"
    assert source_of("M1-concat") is None
    with pytest.raises(ValueError, match=r"M7-concat, .* or 19 others; received 'M8-concat'"):
        surrogate.build("M8-concat")


@pytest.mark.parametrize(
    ("family", "builder", "options", "words"),
    [
        ("M1", build_narrow, {}, "family must be another than M1, M2, .*'M1'"),
        ("../M7", build_narrow, {}, r"FAMILY-CONDITIONING of at most 64 letters.*'\.\./M7-concat'"),
        ("M7", build_narrow, {"conditionings": ["none"]}, r"conditionings must be of concat, FiLM, gated.*\['none'\]"),
        ("M7", build_narrow, {"conditionings": []}, r"conditionings must be of concat.*\[\]"),
        (
            "M7",
            build_otherwise,
            {},
            "builder must take the arguments conditioning, features, name",
        ),
        ("M7", "lstm", {}, "builder must take .*'lstm'"),
    ],
)
def test_bad_registrations_are_refused(family, builder, options, words):
    before = surrogate.names(), dict(FAMILIES)
    with pytest.raises(ValueError, match=words):
        surrogate.register(family, builder, **options)
    assert (surrogate.names(), FAMILIES) == before


@pytest.mark.parametrize(
    "build",
    [
        lambda **_: None,
        lambda features, **_: keras.Model(*[inputs(features)[0]] * 2),
        lambda features, **_: keras.Model(inputs(features)[::-1], layers.Dense(1)(keras.Input((None, 3)))),
        lambda features, **_: (lambda both: keras.Model([*both], layers.Dense(2)(both[0])))(inputs(features)),
    ],
    ids=["nothing", "one input", "other order", "two forces"],
)
def test_builder_of_another_model_is_refused(build):
    def builder(conditioning, features, name):
        try:
            return build(conditioning=conditioning, features=features, name=name)
        except ValueError:  # Keras refuses some of them itself
            return None

    surrogate.register("M7", builder)
    with pytest.raises(ValueError, match=r"^M7-concat must be a functional keras\.Model of the inputs .*; received "):
        surrogate.build("M7-concat")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = 1", "which does not$"),
        ('raise ValueError("\\0")'.replace("\\0", "\0"), "which fails: "),
        ("import surrogate\n\nsurrogate.register('M1', print)", "which fails in line 3: ValueError: family must be"),
        ("def (", "which fails in line 1: SyntaxError: "),
        ("import no_such_library", "which fails in line 1: ModuleNotFoundError: No module named 'no_such_library'"),
        ("raise KeyError('x' * 10_000)", "which fails in line 1: KeyError: "),
        ("import sys\nsys.exit()", "which fails in line 2: SystemExit"),
    ],
)
def test_file_without_family_is_refused(text, words, tmp_path):
    (tmp_path / "own.py").write_text(text)
    expected = rf"^--architecture must be a Python file that calls surrogate\.register; received .*own\.py, {words}"
    with pytest.raises(ValueError, match=expected) as refused:
        load_architectures([tmp_path / "own.py"])
    assert len(str(refused.value)) < 600
    with pytest.raises(FileNotFoundError, match=r"received .*none\.py, which does not exist"):
        load_architectures([tmp_path / "none.py"])
