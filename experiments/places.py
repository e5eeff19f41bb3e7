"""Paths of results and published files, and the arguments of a study, a figure, a table or a place in a document.

The name of a parameter decides its argument. `config` is the content of the module's own TOML file; `dataset`,
`models`, `seeds`, `published` and `configs` are paths, and `out` is that of the study's own result. Any other name is
that of a result, and the argument is its content. It is `None` if the parameter defaults to `None` and the result file
does not exist. Results of the studies in `experiments/paper/` are in `RESULTS/studies`; results that take hours, and
measurements, are published. Keyword-only parameters are options of the command line.
"""

import ast
import inspect
import json
import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import typer

from bem._support.command_line import run_main
from bem._support.text_files import read_toml

HERE = Path(__file__).parent
CONFIGS = HERE / "configs"
FOLDERS = {"dataset": "dataset.h5", "models": "models", "seeds": "seeds.h5", "published": ""}
"""Published files and folders whose path is the argument."""
PUBLISHED_STUDIES = ("feature_sets", "data_efficiency", "ranking", "model_forces")
"""Results that are published in the same folder as the data set, each by the make target of its name."""
PULL_OFF_PLACE = HERE.parent / "bem" / "dataset" / "pull_off_place.json"
"""A result that belongs to the package."""

ResultsFolder = Annotated[Path, typer.Option(help="Folder of results, figures and tables.")]
PublishedFolder = Annotated[Path, typer.Option(help="Folder of published files.")]
LeaveOut = Annotated[bool, typer.Option("--leave-out", help="Go on without it, if what it needs is not there.")]


def studies() -> dict[str, str]:
    """Module of each study, by the name of the study; modules without a study are shared code."""
    found = {}
    for path in HERE.glob("*/*.py"):
        for own in re.findall(r"^def study(?:_(\w+))?\(", path.read_text(encoding="utf-8"), flags=re.MULTILINE):
            found[own or path.stem] = f"experiments.{path.parent.name}.{path.stem}"
    return dict(sorted(found.items()))


def read_config(name: str, path: Path) -> dict[str, Any]:
    """Read a TOML file of the study `name`. Keys that it lacks have the values of `CONFIGS/NAME.toml`.

    Raises:
        FileNotFoundError: A file does not exist.
        ValueError: The file is not TOML, or holds other keys.
    """
    usual = read_toml(CONFIGS / f"{name}.toml")
    try:
        content = read_toml(path)
    except ValueError as error:
        raise ValueError(f"configuration must be TOML; received {str(path)!r} ({error})") from error
    if not content.keys() <= usual.keys():
        raise ValueError(f"configuration must hold {', '.join(usual)} only; received {', '.join(sorted(content))}")
    return usual | content


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
        if name in FOLDERS:
            return self.published / FOLDERS[name]
        if name == "pull_off_place":
            return PULL_OFF_PLACE
        if name in PUBLISHED_STUDIES:
            return self.published / f"{name}.json"
        if (HERE / "paper" / f"{name}.py").is_file():
            return self.results / "studies" / f"{name}.json"
        return self.published / "measurements" / f"{name}.json"

    def read(self, name: str, asked_by: str) -> Any:
        """Content of a result that a make target reads.

        Raises:
            FileNotFoundError: The file does not exist. The message names the command that makes it.
            ValueError: The file is no JSON.
        """
        path = self.path(name)
        if path.is_file():
            try:
                return json.loads(path.read_text(encoding="utf-8"))
            except ValueError as error:
                raise ValueError(f"result file {str(path)!r} must be JSON ({error}); {self.advice(name)}") from error
        raise FileNotFoundError(f"result file {str(path)!r} not found; {self.advice(name, asked_by)}")

    def advice(self, name: str, asked_by: str = "report") -> str:
        """The command that makes a result which `asked_by` reads."""
        target = name.replace("_", "-")
        if name in PUBLISHED_STUDIES:
            return f"`make {target}` makes it"
        if self.path(name).parent.name == "studies":
            return f"`make {asked_by}` makes it"
        return f"`make measure-{target}` makes it" if name in studies() else "restore it from the repository"

    def arguments(self, function: Callable[..., Any], asked_by: str) -> dict[str, Any]:
        """Arguments of a study, or of what composes a figure or a table, by the names of its parameters.

        `asked_by` is the make target that calls it, for messages; options are left out.
        """
        found: dict[str, Any] = {}
        for name, parameter in inspect.signature(function).parameters.items():
            if name in options_of(function):
                continue
            if name == "config":
                module = function.__module__.rpartition(".")[2]
                found[name] = read_config(module, self.taken.get("config", self.configs / f"{module}.toml"))
            elif name == "configs":
                found[name] = self.configs
            elif name == "out" or name in FOLDERS:
                found[name] = self.path(asked_by if name == "out" else name)
            else:
                absent = parameter.default is None and not self.path(name).is_file()
                found[name] = None if absent else self.read(name, asked_by)
        return found


def options_of(function: Callable[..., Any]) -> list[str]:
    """Names of the options of a study, or of what composes a figure or a table."""
    parameters = inspect.signature(function).parameters
    return [name for name, one in parameters.items() if one.kind is inspect.Parameter.KEYWORD_ONLY]


def files_of(function: Callable[..., Any]) -> list[str]:
    """Names of the files and folders that a study reads."""
    known = ("out", "published", "configs", *options_of(function))
    return [name for name in inspect.signature(function).parameters if name not in known]


def with_options(command: Callable[..., None], function: Callable[..., Any]) -> Callable[..., None]:
    """A command whose last parameter, `**options`, is replaced by options for what a function reads, and by its own.

    Args:
        command: The command.
        function: A study, or what composes a figure or a table.
    """
    *shared, _ = inspect.signature(command, eval_str=True).parameters.values()
    found = inspect.signature(function, eval_str=True).parameters
    kind, read = inspect.Parameter.KEYWORD_ONLY, Annotated[Path | None, typer.Option(help="Read this instead.")]
    paths = [inspect.Parameter(name, kind, default=None, annotation=read) for name in files_of(function)]
    every = [*shared, *paths, *(found[name] for name in options_of(function))]
    command.__signature__ = inspect.Signature(every)  # type: ignore[attr-defined]
    command.__annotations__ = {parameter.name: parameter.annotation for parameter in every}
    return command


def taken(function: Callable[..., Any], options: dict[str, Any]) -> dict[str, Path]:
    """Files that the options of `with_options` name, by name; the other options stay."""
    return {one: path for one in files_of(function) if (path := options.pop(one))}


def overview(program: str, known: Mapping[str, str]) -> str:
    """What `--help` prints: the names, each with the first line of the docstring of its study or else of its module."""
    lines, width = [], max(map(len, known)) + 2
    for name, module in known.items():
        spec = find_spec(module)  # read, not imported: some modules need what is not installed
        tree = ast.parse(Path(str(spec and spec.origin)).read_text(encoding="utf-8"))
        own = [one for one in tree.body if isinstance(one, ast.FunctionDef) and one.name == f"study_{name}"]
        said = ast.get_docstring(own[0] if own else tree) or ""
        lines.append(f"  {name:{width}}{said.partition(chr(10))[0]}")
    return "\n".join([f"Usage: python -m {program} NAME [OPTIONS]; NAME --help lists the options.", "", *lines])


def run_named(program: str, known: Mapping[str, str], command_of: Callable[[ModuleType, str], Any]) -> None:
    """Run the module that the command line names, with the options that follow the name.

    `known` are the modules by name, and `command_of` gives the command of one.
    """
    name, *rest = sys.argv[1:] or [""]
    if name in ("--help", "-h"):
        print(overview(program, known))
        return
    if name not in known:
        print(f"python -m {program}: Expected one of {', '.join(known)}; received {name!r}", file=sys.stderr)
        sys.exit(2)
    sys.argv[:] = [f"{program} {name}", *rest]
    module, called = import_module(known[name]), f"python -m {program} {name}"
    run_main(command_of(module, name), called, program=called, help=module.__doc__)
