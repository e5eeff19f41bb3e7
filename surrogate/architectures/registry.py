"""Registration of user-defined architectures, from Python or from a file given to a command.

A run records the name and the SHA-256 sum of the file that defines the builder. With another file, the run is neither
resumed nor loaded. Only the sum of this one file is recorded, so the file should contain the whole architecture.
"""

from __future__ import annotations

import hashlib
import inspect
import reprlib
import sys
import textwrap
import traceback
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from bem._support.outputs import plain_name
from surrogate.architectures.naming import CONDITIONINGS, FAMILIES, Family, Source, split_name
from surrogate.backend import import_keras

if TYPE_CHECKING:
    import keras

REGISTERING = "--architecture must be a Python file that calls surrogate.register"
ARGUMENTS = ("conditioning", "features", "name")


_loading: list[Source] = []


def register(family: str, builder: Callable[..., keras.Model], *, conditionings: Sequence[str] = CONDITIONINGS) -> None:
    """Register an architecture under the names `FAMILY-CONDITIONING`, such as `"M7-concat"`.

    Functions and commands that take the name of an architecture then accept these names. A later call for the same
    family replaces an earlier one.

    Args:
        family: Name of the family, of letters, digits, '.', '_' and '-'.
        builder: Function that is called as `builder(conditioning=..., features=..., name=...)`. It returns an untrained
            functional `keras.Model` with that name, the two inputs of
            `surrogate.architectures.common.inputs(features)`, and as output the scaled force of shape
            `(batch, steps, 1)`. Lists and figures show the first line of its docstring.
        conditionings: Conditionings that the builder supports, of `"concat"`, `"FiLM"` and `"gated"`.

    Raises:
        ValueError: the name is not plain or is one of the paper's families, a conditioning is unknown, or the builder
            does not take these arguments.
    """
    if not conditionings or not set(conditionings) <= set(CONDITIONINGS):
        raise ValueError(f"conditionings must be of {', '.join(CONDITIONINGS)}; received {conditionings!r}")
    for conditioning in conditionings:
        plain_name(f"{family}-{conditioning}", "a model's name FAMILY-CONDITIONING")
    if family in FAMILIES and not callable(FAMILIES[family].builder):
        raise ValueError(f"family must be another than {', '.join(FAMILIES)}; received {family!r}")
    try:
        inspect.signature(builder).bind(**dict.fromkeys(ARGUMENTS))
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"builder must take the arguments {', '.join(ARGUMENTS)}; received {reprlib.repr(builder)} ({error})"
        ) from error
    try:
        file = Path(inspect.getsourcefile(builder) or "")
    except TypeError:
        file = Path()
    source = _loading[-1] if _loading else _source(file) if file.is_file() else None
    description = (inspect.getdoc(builder) or "a user's architecture").splitlines()[0].rstrip(".")
    FAMILIES[family] = Family(description, builder, conditionings=tuple(conditionings), source=source)


def load_architectures(files: Iterable[Path]) -> None:
    """Run Python files that call `surrogate.register`.

    Raises:
        FileNotFoundError: a file does not exist.
        ModuleNotFoundError: Keras is not installed.
        ValueError: a file raises an exception, or registers nothing; the message says where.
    """
    for file in files:
        if not file.is_file():
            raise FileNotFoundError(f"{REGISTERING}; received {file}, which does not exist")
        import_keras()
        before, source = dict(FAMILIES), _source(file)
        # The import system would write a compiled copy next to the file.
        module = ModuleType(f"architecture_{source.sha256[:16]}")
        sys.modules[module.__name__] = module
        _loading.append(source)
        try:
            exec(compile(file.read_bytes(), str(file), "exec"), module.__dict__)
        except (Exception, SystemExit) as error:
            reason = textwrap.shorten(f"{type(error).__name__}: {error}", 300)
            raise ValueError(f"{REGISTERING}; received {file}, which fails{_line(error, file)}: {reason}") from error
        finally:
            _loading.pop()
        if before == FAMILIES:
            raise ValueError(f"{REGISTERING}; received {file}, which does not")


def source_of(name: str) -> Source | None:
    """Return the file that registered an architecture; `None` for those of the package, or without a file.

    Raises:
        ValueError: the name is unknown.
    """
    return FAMILIES[split_name(name)[0]].source


def require_source(run: dict[str, Any]) -> None:
    """Check that the architecture in a `run.json` is registered, and from the same file as in the training.

    Raises:
        ValueError: the architecture is not registered, or from another file; the message names the file.
    """
    recorded = run.get("architecture_file")
    if not isinstance(recorded, dict):
        return
    file, digest = (str(recorded.get(key)) for key in ("name", "sha256"))
    family = run["architecture"].rpartition("-")[0]
    source = FAMILIES[family].source if family in FAMILIES else None
    if source is None or source.sha256 != digest:
        received = f"{source.name} ({source.sha256[:12]})" if source else f"no file with {run['architecture']}"
        raise ValueError(
            f"{file} ({digest[:12]}), which built {run['name']}, must be given by --architecture or an import; "
            f"received {received}"
        )


def check_model(model: Any, name: str, features: str) -> None:
    """Check what a builder returned.

    Raises:
        ValueError: it is not a functional model with the two inputs and the output.
    """
    from surrogate.data.features import channel_names

    channels = len(channel_names(features))
    expected = {"sequence": (None, None, channels), "tabor": (None, 1)}
    inputs = {tensor.name: tuple(tensor.shape) for tensor in getattr(model, "inputs", None) or ()}
    outputs = [tuple(tensor.shape) for tensor in getattr(model, "outputs", None) or ()]
    if list(inputs.items()) != list(expected.items()) or outputs != [(None, None, 1)]:
        raise ValueError(
            f"{name} must be a functional keras.Model of the inputs {expected} and an output of shape (None, None, 1); "
            f"received {type(model).__name__} of the inputs {inputs} and outputs of shapes {outputs}"
        )


def _source(file: Path) -> Source:
    return Source(file.name, hashlib.sha256(file.read_bytes()).hexdigest())


def _line(error: BaseException, file: Path) -> str:
    """Return the line of the file in which an exception was raised, as text for a message."""
    if isinstance(error, SyntaxError) and error.lineno:
        return f" in line {error.lineno}"
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(file)]
    return f" in line {lines[-1]}" if lines else ""
