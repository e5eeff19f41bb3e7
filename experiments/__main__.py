"""Run one study: `python -m experiments NAME ...`.

A module with a function `study` returns the content of one result. The runner supplies the arguments of the function,
as `experiments.places` describes, and writes the result under the name of the module. A module with a function `main`
has options of its own; `--help` lists them. The option `--depends FILE` before the name also writes the make rule of
`FILE`: the files from which the result was made.
"""

import re
import sys
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from bem._support.command_line import run_main
from experiments.common import CONFIGS, write_result
from experiments.dependencies import Recorder
from experiments.places import Places, keywords, replaced

HERE = Path(__file__).parent
RUNS = re.compile(r"^def (?:main|study)\(", re.MULTILINE)


def modules() -> dict[str, str]:
    """Module of each study, by the name of the study; modules without `main` or `study` are shared code."""
    files = sorted(path for path in HERE.glob("*/*.py") if RUNS.search(path.read_text(encoding="utf-8")))
    return {path.stem: f"experiments.{path.parent.name}.{path.stem}" for path in files}


def main() -> None:
    """Run the study that the command line names, with the options that follow the name."""
    words = sys.argv[1:]
    target = Path(words[1]) if words[:1] == ["--depends"] and len(words) > 1 else None
    name, *rest = (words[2:] if target else words) or [""]
    known = modules()
    if name not in known:
        print(f"python -m experiments: Expected one of {', '.join(known)}; received {name!r}", file=sys.stderr)
        sys.exit(2)
    sys.argv[:] = [f"experiments {name}", *rest]
    recorder = Recorder() if target else None
    module = import_module(known[name])
    called = f"python -m experiments {name}"
    if not hasattr(module, "study"):
        run_main(module.main, program=called, help=module.__doc__)
        return

    def command(
        context: typer.Context,
        results: Annotated[Path, typer.Option(help="Folder of results.")] = Path("results"),
        published: Annotated[Path, typer.Option(help="Folder of published files.")] = Path("published"),
        configs: Annotated[Path, typer.Option(help="Folder of the TOML files of studies.")] = CONFIGS,
        take: Annotated[list[str] | None, typer.Option(help="NAME=FILE: read this file instead.")] = None,
        out: Annotated[Path | None, typer.Option(help="Result file to write.")] = None,
    ) -> None:
        places = Places(results, published, configs, replaced(take or []))
        arguments = places.arguments(module.study, f"make {name}")
        content = module.study(**arguments, **keywords(context.args, module.study))
        if content is None:
            return
        place = out or places.path(name)
        write_result(place, name, content)
        if recorder and target:
            recorder.add(*(value for value in arguments.values() if isinstance(value, Path) and value.is_file()))
            recorder.write(target, results, published, configs)

    settings = {"allow_extra_args": True, "ignore_unknown_options": True}
    run_main(command, called, program=called, help=module.__doc__, context_settings=settings)


if __name__ == "__main__":
    main()
