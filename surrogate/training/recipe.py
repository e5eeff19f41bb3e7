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
  its error is smaller; for the learning rate, if it is smaller by more than `least_gain`, by default Keras's 1e-4.

The weights with the smallest validation error are kept in every case. Recipe `paper` is the paper's, of its section
"Training and hyperparameters", with Keras's defaults for all that it does not state; `paper-as-worded` halves the rate
by the words of that section, without Keras's threshold.
"""

from __future__ import annotations

from dataclasses import MISSING, asdict, dataclass, fields, replace
from importlib import resources
from pathlib import Path
from typing import Any

from bem._support.text_files import read_toml
from bem._support.validation import finite_number, instance, whole_number
from bem._support.wording import shortened, shown

WHOLE = {"seed": 0, "batch_size": 1, "epochs": 1, "patience": 0, "stop_after": 1}
"""Smallest value of each whole number."""
NUMBERS: dict[str, dict[str, float]] = {
    "learning_rate": {"above": 0.0},
    "gradient_norm": {"above": 0.0},
    "factor": {"above": 0.0},
    "minimum_rate": {"low": 0.0},
    "least_gain": {"low": 0.0},
    "warmup_epochs": {"low": 0.0},
    "weight_average": {"above": 0.0, "high": 1.0},
    "dropout_until": {"low": 0.0, "high": 1.0},
}
"""Bounds of each other number, as `bem._support.validation.finite_number` takes them."""
CHOICES = {"optimizer": ("adam", "soap"), "loop": ("fit",)}


class _Checked:
    """Checks the fields of a table when it is made."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value is None:
                continue
            if name in WHOLE:
                whole_number(name, value, low=WHOLE[name])
            elif name in NUMBERS:
                finite_number(name, value, **NUMBERS[name])
            elif value not in CHOICES.get(name, (value,)):
                raise ValueError(f"{name} must be {' or '.join(CHOICES[name])}; received {shown(value)}")


@dataclass(frozen=True)
class Cosine(_Checked):
    """Learning-rate schedule: a linear warm-up, then a cosine decay to zero at the last epoch.

    Args:
        warmup_epochs: Length of the warm-up, in epochs.
    """

    warmup_epochs: float = 0.0


@dataclass(frozen=True)
class Plateau(_Checked):
    """Learning-rate schedule on a plateau of the validation error, with early stopping.

    Args:
        factor: Factor by which the learning rate is multiplied.
        patience: Epochs without a smaller validation error before that.
        minimum_rate: Smallest learning rate.
        stop_after: Epochs without a smaller validation error before training stops.
        least_gain: Decrease of the validation error that the learning rate counts as one, `min_delta` of Keras's
            `ReduceLROnPlateau`; `None` is Keras's default, 1e-4. Early stopping counts any decrease.
    """

    factor: float
    patience: int
    minimum_rate: float
    stop_after: int
    least_gain: float | None = None


@dataclass(frozen=True)
class Recipe(_Checked):
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
        super().__post_init__()
        instance("name", self.name, (str,))
        if self.cosine and self.plateau:
            raise ValueError("[cosine] and [plateau] must not stand together; received both")

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
            raise FileNotFoundError(f"recipe must be {', '.join(sorted(packaged))} or a file; received {source}")
        try:
            table = read_toml(file)
        except ValueError as error:
            raise ValueError(f"a training recipe must be TOML; received {source} ({error})") from error
        for key, schedule in (("cosine", Cosine), ("plateau", Plateau)):
            if key in table:
                table[key] = _made(schedule, table[key], f"the table [{key}]", source)
        recipe: Recipe = _made(cls, table, "a training recipe", source)
        return recipe

    def with_overrides(self, **overrides: Any) -> Recipe:
        """Return a copy with fields replaced by keyword; a value of `None` keeps the field.

        Raises:
            ValueError: as for the constructor.
        """
        return replace(self, **{name: value for name, value in overrides.items() if value is not None})

    def as_dict(self) -> dict[str, Any]:
        """Return the fields that are not `None`, tables as dictionaries."""
        return asdict(self, dict_factory=lambda pairs: {name: value for name, value in pairs if value is not None})


def _made(cls: type, table: Any, noun: str, source: str | Path) -> Any:
    """Return a data class made of a TOML table.

    Raises:
        ValueError: a key is missing or unknown, or a value is not allowed; the message says what is.
    """
    if not isinstance(table, dict):
        raise ValueError(f"{noun} must be a table; received {shown(table)} in {source}")
    keys = {field.name: field.default is MISSING for field in fields(cls)}
    wrong = {
        "without": [key for key, needed in keys.items() if needed and key not in table],
        "with": [key for key in table if key not in keys],
    }
    if any(wrong.values()):
        allowed = ", ".join(key if needed else f"optionally {key}" for key, needed in keys.items())
        received = " and ".join(f"{word} {shortened(', '.join(names))}" for word, names in wrong.items() if names)
        raise ValueError(f"{noun} must have {allowed}; received {source} {received}")
    try:
        return cls(**table)
    except ValueError as error:
        raise ValueError(f"{error} in {source}") from error
