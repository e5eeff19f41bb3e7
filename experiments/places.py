"""Where results and published files are, and what the parameters of a study, a figure or a table stand for.

A parameter `config` is the module's own TOML file, `dataset`, `models`, `seeds` and `configs` are paths, and any other
is the content of the result of that name, `None` where it defaults to that and nothing is there. Results of the studies
in `experiments/paper/` are in `RESULTS/studies`; those that take hours, and measurements, are published.
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
"""Results published beside the data set."""


@dataclass(frozen=True)
class Places:
    """Folders of results, of published files and of configurations; `taken` are files to read instead of the usual."""

    results: Path = Path("results")
    published: Path = Path("published")
    configs: Path = CONFIGS
    taken: Mapping[str, Path] = field(default_factory=dict)

    def path(self, name: str) -> Path:
        """The place of the data set, the models, their seeds or a result."""
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

        Raises:
            FileNotFoundError: naming the target that makes it; where that is a study, the target that asked.
        """
        path = self.path(name)
        if not path.is_file():
            made_by = maker(name) or asked_by
            raise FileNotFoundError(f"result file {str(path)!r} not found; `{made_by}` makes it")
        return json.loads(path.read_text(encoding="utf-8"))

    def arguments(self, function: Callable[..., Any], asked_by: str) -> dict[str, Any]:
        """What the parameters of a function stand for; those by keyword alone are the caller's."""
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
        # What draws reads no settings, and is not to depend on all that a study shares.
        from experiments.common import read_config

        name = module.__name__.rpartition(".")[2] if module else ""
        path = self.taken.get("config", self.configs / f"{name}.toml")
        return read_config(path, *getattr(module, "KEYS", ()))


def keywords(words: list[str], function: Callable[..., Any]) -> dict[str, Any]:
    """`--NAME VALUE ...` as the keyword parameters of a function; a parameter that is a tuple may be given repeatedly.

    Raises:
        ValueError: another option, or one without its value.
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
            raise ValueError(f"options must be {allowed}; received {' '.join(words)!r}")
        repeated = str(known[name].annotation).startswith("tuple[")  # a text, or what prints as one
        found[name] = (*found.get(name, ()), value) if repeated else value
    absent = [name for name, parameter in known.items() if parameter.default is parameter.empty and name not in found]
    if absent:
        raise ValueError(f"--{absent[0]} VALUE must be given")
    return found


def replaced(pairs: list[str]) -> dict[str, Path]:
    """`NAME=FILE ...` as files by name.

    Raises:
        ValueError: a pair without a name or a file.
    """
    split = [pair.partition("=") for pair in pairs]
    if wrong := [pair for pair, (name, _, file) in zip(pairs, split, strict=True) if not (name and file)]:
        raise ValueError(f"--take must be NAME=FILE; received {wrong[0]!r}")
    return {name: Path(file) for name, _, file in split}
