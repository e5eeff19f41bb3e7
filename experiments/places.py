"""Paths of results and published files, and the arguments of a study, a figure or a table.

The name of a parameter decides its argument. `config` is the content of the module's own TOML file; `dataset`,
`models`, `seeds` and `configs` are paths. Any other name is that of a result, and the argument is its content. It is
`None` if the parameter defaults to `None` and the result file does not exist. Results of the studies in
`experiments/paper/` are in `RESULTS/studies`; results that take hours, and measurements, are published.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from experiments.registry import maker

HERE = Path(__file__).parent
CONFIGS = HERE / "configs"
PUBLISHED_STUDIES = ("feature_sets", "data_efficiency", "accuracy_price", "ranking", "model_forces")
"""Results that are published in the same folder as the data set."""


@dataclass(frozen=True)
class Places:
    """Folders of results, published files and configurations; `taken` maps names to files that are read instead."""

    results: Path = Path("results")
    published: Path = Path("published")
    configs: Path = CONFIGS
    taken: Mapping[str, Path] = field(default_factory=dict)

    def path(self, name: str) -> Path:
        """Path of the data set, the models, their seeds or a result, by name."""
        if name in self.taken:
            return self.taken[name]
        if name in ("dataset", "models", "seeds"):
            return self.published / {"dataset": "dataset.h5"}.get(name, name)
        if name in PUBLISHED_STUDIES:
            return self.published / f"{name}.json"
        if name != "canonical_times" and (HERE / "paper" / f"{name}.py").is_file():
            return self.results / "studies" / f"{name}.json"
        return self.published / "measurements" / f"{name}.json"

    def read(self, name: str, asked_by: str) -> Any:
        """Content of a result.

        Args:
            name: The result.
            asked_by: Make target that reads it.

        Raises:
            FileNotFoundError: The file does not exist. The message names the target that publishes the result, or, for
                the result of a study, `asked_by`.
        """
        path = self.path(name)
        if not path.is_file():
            made_by = maker(name) or asked_by
            raise FileNotFoundError(f"result file {str(path)!r} not found; `{made_by}` makes it")
        return json.loads(path.read_text(encoding="utf-8"))

    def arguments(self, function: Callable[..., Any], asked_by: str) -> dict[str, Any]:
        """Arguments of a function by the names of its parameters, keyword-only parameters excepted."""
        return {
            name: self._argument(parameter, function, asked_by)
            for name, parameter in inspect.signature(function).parameters.items()
            if parameter.kind is not inspect.Parameter.KEYWORD_ONLY
        }

    def _argument(self, parameter: inspect.Parameter, function: Callable[..., Any], asked_by: str) -> Any:
        name = parameter.name
        if name == "config":
            module = inspect.getmodule(function)
            return self._config(module)
        if name in ("dataset", "models", "seeds", "configs"):
            return self.configs if name == "configs" else self.path(name)
        if parameter.default is None and not self.path(name).is_file():
            return None
        return self.read(name, asked_by)

    def _config(self, module: ModuleType | None) -> dict[str, Any]:
        # Imported here, so that a figure, which has no settings, does not depend on the modules that studies share.
        from experiments.common import read_config

        name = module.__name__.rpartition(".")[2] if module else ""
        path = self.taken.get("config", self.configs / f"{name}.toml")
        return read_config(path, *getattr(module, "KEYS", ()))


def keywords(words: list[str], function: Callable[..., Any]) -> dict[str, Any]:
    """Convert `--NAME VALUE ...` to keyword arguments of a function; an option whose type is a tuple is repeatable.

    Raises:
        ValueError: An option is unknown, lacks its value, or is required and missing.
    """
    known = {
        name: parameter
        for name, parameter in inspect.signature(function).parameters.items()
        if parameter.kind is inspect.Parameter.KEYWORD_ONLY
    }
    found: dict[str, Any] = {}
    for option, value in zip(words[::2], [*words[1::2], None], strict=False):
        name = option.removeprefix("--")
        if name not in known or not option.startswith("--") or value is None:
            allowed = ", ".join(f"--{one} VALUE" for one in known) or "no other options"
            raise ValueError(f"expected {allowed}; received {' '.join(words)!r}")
        repeated = str(known[name].annotation).startswith("tuple[")  # a string, or an object whose text is the same
        found[name] = (*found.get(name, ()), value) if repeated else value
    absent = [name for name, parameter in known.items() if parameter.default is parameter.empty and name not in found]
    if absent:
        raise ValueError(f"--{absent[0]} VALUE must be given")
    return found


def replaced(pairs: list[str]) -> dict[str, Path]:
    """Convert `NAME=FILE ...` to files by name.

    Raises:
        ValueError: A pair lacks its name or its file.
    """
    split = [pair.partition("=") for pair in pairs]
    if wrong := [pair for pair, (name, _, file) in zip(pairs, split, strict=True) if not (name and file)]:
        raise ValueError(f"--take must be NAME=FILE; received {wrong[0]!r}")
    return {name: Path(file) for name, _, file in split}
