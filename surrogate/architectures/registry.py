"""Architectures that users register by name, from Python or from a file given to a command.

A run records the name and SHA-256 sum of the file that defines the builder, and is neither resumed nor loaded with
another file. Only the sum of this one file is recorded, so it should contain the whole architecture.
"""

from __future__ import annotations

import hashlib
import inspect
import reprlib
import sys
import textwrap
import traceback
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from bem._support.outputs import plain_name
from surrogate.architectures.naming import CONDITIONINGS, CONDITIONINGS_OF, FAMILIES, split_name
from surrogate.backend import import_keras

if TYPE_CHECKING:
    import keras

WANTED = "Expected a Python file that calls surrogate.register"
ARGUMENTS = ("conditioning", "features", "name")


@dataclass(frozen=True)
class Source:
    """A file by its name, without the folder, and the SHA-256 sum of its content."""

    name: str
    sha256: str

    @classmethod
    def of(cls, name: str, content: bytes) -> Source:
        """Describe a file's content."""
        return cls(name, hashlib.sha256(content).hexdigest())


@dataclass(frozen=True)
class Registered:
    """A builder, and the file that defines it if there is one."""

    builder: Callable[..., keras.Model]
    source: Source | None


REGISTERED: dict[str, Registered] = {}
_loading: list[Source] = []


def register(family: str, builder: Callable[..., keras.Model], *, conditionings: Sequence[str] = CONDITIONINGS) -> None:
    """Register an architecture of your own under the names `FAMILY-CONDITIONING`, such as `"M7-concat"`.

    These names are then accepted wherever a model's name is expected. A later call for the same family replaces an
    earlier one.

    Args:
        family: Its name: letters, digits, '.', '_' and '-'.
        builder: Called as `builder(conditioning=..., features=..., name=...)`, it returns an untrained functional
            `keras.Model` of that name, from the two inputs of `surrogate.architectures.common.inputs(features)` to
            a scaled force of shape `(batch, steps, 1)`. Lists and figures show the first line of its docstring.
        conditionings: The ways to include the Tabor parameter that it supports, of `"concat"`, `"FiLM"` and
            `"gated"`.

    Raises:
        ValueError: a name that is not plain or is one of the paper's families, unknown conditionings, or a builder that
            cannot be called so.
    """
    if not conditionings or not set(conditionings) <= set(CONDITIONINGS):
        raise ValueError(f"Expected conditionings of {', '.join(CONDITIONINGS)}. Received: {conditionings!r}")
    for conditioning in conditionings:
        plain_name(f"{family}-{conditioning}", "a model's name FAMILY-CONDITIONING")
    if family in FAMILIES and family not in REGISTERED:
        raise ValueError(f"Expected a family other than {', '.join(FAMILIES)}. Received: family={family!r}")
    try:
        inspect.signature(builder).bind(**dict.fromkeys(ARGUMENTS))
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"Expected a builder to call as builder({', '.join(f'{one}=...' for one in ARGUMENTS)}). "
            f"Received: {reprlib.repr(builder)} ({error})"
        ) from error
    REGISTERED[family] = Registered(builder, _loading[-1] if _loading else _source_of(builder))
    CONDITIONINGS_OF[family] = tuple(conditionings)
    FAMILIES[family] = (inspect.getdoc(builder) or "a user's architecture").splitlines()[0].rstrip(".")


def load_architectures(files: Iterable[Path]) -> None:
    """Run files that call `surrogate.register`, for a command line.

    Raises:
        FileNotFoundError: no such file.
        ModuleNotFoundError: Keras is not installed.
        ValueError: a file fails, or registers nothing; the message says where.
    """
    for file in files:
        if not file.is_file():
            raise FileNotFoundError(f"{WANTED}. Received: {file}")
        import_keras()
        content, before = file.read_bytes(), dict(REGISTERED)
        source = Source.of(file.name, content)
        # Not by the import system, which would leave a compiled copy beside the file.
        module = ModuleType(f"architecture_{source.sha256[:16]}")
        sys.modules[module.__name__] = module
        _loading.append(source)
        try:
            exec(compile(content, str(file), "exec"), module.__dict__)
        except (Exception, SystemExit) as error:
            words = textwrap.shorten(f"{type(error).__name__}: {error}", 300)
            raise ValueError(f"{WANTED}. Received: {file}, which fails{_line(error, file)}: {words}") from error
        finally:
            _loading.pop()
        if before == REGISTERED:
            raise ValueError(f"{WANTED}. Received: {file}, which does not")


def source_of(name: str) -> Source | None:
    """Return the file a model's architecture is from; `None` for the package's own, and where there is no file."""
    found = REGISTERED.get(split_name(name)[0])
    return found.source if found else None


def require_source(run: dict[str, Any]) -> None:
    """Check that the architecture of a model's `run.json` is known, and from the very file it was trained with.

    Raises:
        ValueError: it is not; the message names the file.
    """
    recorded = run.get("architecture_file")
    if not isinstance(recorded, dict):
        return
    file, digest = (str(recorded.get(key)) for key in ("name", "sha256"))
    family = run["architecture"].rpartition("-")[0]
    wanted = f"Expected {file} ({digest[:12]}), which built {run['name']}, by --architecture or an import"
    if family not in REGISTERED:
        raise ValueError(f"{wanted}. Received: no architecture called {run['architecture']}")
    source = REGISTERED[family].source
    if source is None or source.sha256 != digest:
        received = f"{source.name} ({source.sha256[:12]})" if source else "one from no file"
        raise ValueError(f"{wanted}. Received: {received}")


def check_model(model: Any, name: str, features: str) -> None:
    """Check what a user's builder returned.

    Raises:
        ValueError: something else than a functional model of the two inputs and the output.
    """
    from surrogate.data.features import channel_names

    channels = len(channel_names(features))
    wanted = {"sequence": (None, None, channels), "tabor": (None, 1)}
    inputs = {tensor.name: tuple(tensor.shape) for tensor in getattr(model, "inputs", None) or ()}
    outputs = [tuple(tensor.shape) for tensor in getattr(model, "outputs", None) or ()]
    if list(inputs.items()) != list(wanted.items()) or outputs != [(None, None, 1)]:
        raise ValueError(
            f"Expected a functional keras.Model of the inputs {wanted} and an output of shape (None, None, 1). "
            f"Received as {name}: {type(model).__name__} of the inputs {inputs} and outputs of shapes {outputs}"
        )


def _source_of(builder: Callable[..., Any]) -> Source | None:
    try:
        file = inspect.getsourcefile(builder)
    except TypeError:
        return None
    return Source.of(Path(file).name, Path(file).read_bytes()) if file and Path(file).is_file() else None


def _line(error: BaseException, file: Path) -> str:
    """Where in the file it failed, in words."""
    if isinstance(error, SyntaxError):
        return f" in line {error.lineno}"
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(file)]
    return f" in line {lines[-1]}" if lines else ""
