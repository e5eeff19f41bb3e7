"""Training recipes: TOML files with all hyperparameters of a training.

Required keys: `name`, `seed` (of weights, batches and dropout), `batch_size`, `epochs` (the largest number of epochs)
and `learning_rate` (the peak of the schedule). Optional keys:

- `optimizer`: `"adam"`, the default, or `"soap"`.
- `gradient_norm`: global norm to which larger gradients are clipped.
- `weight_average`: the weights that are evaluated and kept are an exponential moving average of the trained weights.
  The value is the time constant as a fraction of all steps, in (0, 1]. It is a fraction so that a shorter training
  averages over fewer steps.
- `dropout_until`: fraction of the epochs, in [0, 1], after which dropout is switched off, so that the last epochs train
  the network that predicts. A network that is trained with dropout to the end may predict with a bias.
- `loop`: `"fit"` or absent. Every recipe trains by `model.fit` (`surrogate.training.fitting`); the key remains because
  it tells recipes, and so trainings, apart.

At most one table sets the learning-rate schedule; without a table the learning rate is constant:

- `[cosine]`: a linear warm-up over `warmup_epochs`, then a cosine decay to zero at the last epoch.
- `[plateau]`: the learning rate is multiplied by `factor` after `patience` epochs without a smaller validation error,
  down to `minimum_rate`. Early stopping ends the training after `stop_after` such epochs. An epoch counts as better if
  its error is smaller; for Keras's `ReduceLROnPlateau`, if it is smaller by more than 1e-4.

The weights with the smallest validation error are kept in every case. Recipe `paper` is the paper's, of its section
"Training and hyperparameters".
"""

from __future__ import annotations

import json
import math
import reprlib
from collections.abc import Sequence
from dataclasses import MISSING, asdict, dataclass, fields, replace
from importlib import resources
from pathlib import Path
from typing import Any, get_args, get_type_hints

from bem._support.text_files import read_toml

OPTIMIZERS = ("adam", "soap")
LOOPS = ("fit",)
KINDS = {int: "a whole number", float: "a finite number", str: "a text"}


@dataclass(frozen=True)
class Cosine:
    """Learning-rate schedule: a linear warm-up, then a cosine decay to zero at the last epoch.

    Args:
        warmup_epochs: Length of the warm-up, in epochs.
    """

    warmup_epochs: float = 0.0


@dataclass(frozen=True)
class Plateau:
    """Learning-rate schedule on a plateau of the validation error, with early stopping.

    Args:
        factor: Factor by which the learning rate is multiplied.
        patience: Epochs without a smaller validation error before that.
        minimum_rate: Smallest learning rate.
        stop_after: Epochs without a smaller validation error before training stops.
    """

    factor: float
    patience: int
    minimum_rate: float
    stop_after: int


@dataclass(frozen=True)
class Recipe:
    """All hyperparameters of a training; the docstring of the module explains the fields.

    Raises:
        ValueError: a field is outside its range, or two fields exclude each other.
    """

    name: str
    seed: int
    batch_size: int
    epochs: int
    learning_rate: float
    optimizer: str = "adam"
    gradient_norm: float | None = None
    weight_average: float | None = None
    dropout_until: float | None = None
    loop: str | None = None
    cosine: Cosine | None = None
    plateau: Plateau | None = None

    def __post_init__(self) -> None:
        for name in ("batch_size", "epochs", "learning_rate"):
            if not getattr(self, name) > 0:
                raise ValueError(f"Expected {name} above zero. Received: {name}={getattr(self, name)!r}")
        if self.seed < 0:
            raise ValueError(f"Expected a seed of zero or above. Received: seed={self.seed!r}")
        if self.optimizer not in OPTIMIZERS:
            raise ValueError(f"Expected optimizer {' or '.join(OPTIMIZERS)}. Received: optimizer={self.optimizer!r}")
        if self.weight_average is not None and not 0.0 < self.weight_average <= 1.0:
            raise ValueError(f"Expected weight_average in (0, 1]. Received: weight_average={self.weight_average!r}")
        if self.dropout_until is not None and not 0.0 <= self.dropout_until <= 1.0:
            raise ValueError(f"Expected dropout_until in [0, 1]. Received: dropout_until={self.dropout_until!r}")
        if self.loop is not None and self.loop not in LOOPS:
            raise ValueError(f"Expected loop {' or '.join(LOOPS)}, or no such key. Received: loop={self.loop!r}")
        if self.plateau and not self.plateau.stop_after > 0:
            raise ValueError(f"Expected stop_after above zero. Received: stop_after={self.plateau.stop_after!r}")
        if self.cosine and self.plateau:
            raise ValueError("Expected at most one of [cosine] and [plateau]. Received: both")

    @classmethod
    def load(cls, source: str | Path) -> Recipe:
        """Read a recipe of this package by name, such as `"swift"`, or a TOML file by path.

        Raises:
            FileNotFoundError: the argument is neither the name of a recipe nor a file.
            ValueError: the file is not a recipe; the message names the key or value.
        """
        folder = resources.files("surrogate.training") / "recipes"
        packaged = {file.name.removesuffix(".toml"): file for file in folder.iterdir() if file.name.endswith(".toml")}
        file = packaged.get(str(source), Path(source))
        if not file.is_file():
            raise FileNotFoundError(f"Expected a recipe ({', '.join(sorted(packaged))}) or a file. Received: {source}")
        try:
            content = read_toml(file)
        except ValueError as error:
            raise ValueError(f"Expected a training recipe in TOML. Received: {source} ({error})") from error
        for key, kind in (("cosine", Cosine), ("plateau", Plateau)):
            if key in content:
                content[key] = kind(**_checked(content[key], kind, f"the table [{key}]", source))
        return cls(**_checked(content, cls, "a training recipe", source))

    def with_overrides(self, **overrides: Any) -> Recipe:
        """Return a copy with fields replaced by keyword; a value of `None` keeps the field.

        Raises:
            ValueError: as for the constructor.
        """
        return replace(self, **{name: value for name, value in overrides.items() if value is not None})

    def as_dict(self) -> dict[str, Any]:
        """Return the fields that are not `None`, tables as dictionaries."""
        return {name: value for name, value in asdict(self).items() if value is not None}

    def to_toml(self) -> str:
        """Return the recipe as TOML, which `load` reads."""
        lines, tables = [], []
        for name, value in self.as_dict().items():
            if isinstance(value, dict):
                tables += [f"\n[{name}]", *(f"{key} = {json.dumps(one)}" for key, one in value.items())]
            else:
                lines.append(f"{name} = {json.dumps(value)}")
        return "\n".join([*lines, *tables]) + "\n"


def _checked(content: Any, kind: type, what: str, source: str | Path) -> dict[str, Any]:
    """Return the content of a TOML table after checking it against the fields of a data class.

    Raises:
        ValueError: a key is missing or unknown, or a value has another type; the message says what is allowed.
    """
    if not isinstance(content, dict):
        raise ValueError(f"Expected {what}. Received: {reprlib.repr(content)} in {source}")
    needed = [field.name for field in fields(kind) if field.default is MISSING]
    optional = [field.name for field in fields(kind) if field.default is not MISSING]
    found = {
        "without": [key for key in needed if key not in content],
        "with": [key for key in content if key not in (*needed, *optional)],
    }
    if any(found.values()):
        allowed = f"Expected {', '.join(needed)}" if needed else f"Expected no keys but {', '.join(optional)}"
        allowed += f", and optionally {', '.join(optional)}," if needed and optional else ""
        received = " and ".join(f"{word} {_listed(keys)}" for word, keys in found.items() if keys)
        raise ValueError(f"{allowed} in {what}. Received: {source} {received}")
    hints = get_type_hints(kind)
    for key, value in content.items():
        wanted = next(one for one in (*get_args(hints[key]), hints[key]) if one is not type(None))
        if wanted in KINDS and not _is_a(wanted, value):
            raise ValueError(
                f"Expected {KINDS[wanted]} as {key} in {what}. Received: {reprlib.repr(value)} in {source}"
            )
    return content


def _is_a(kind: type, value: Any) -> bool:
    if kind is float:
        return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    return isinstance(value, kind) and not isinstance(value, bool)


def _listed(keys: Sequence[str], most: int = 5) -> str:
    shown = ", ".join(key if len(key) < 30 else reprlib.repr(key) for key in keys[:most])
    return f"{shown} and {len(keys) - most} more" if len(keys) > most else shown
