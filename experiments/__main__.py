"""Run one study: `python -m experiments NAME ...`.

A module with a function `study` returns the content of one result. The runner supplies the arguments of the function,
as `experiments.places` describes, and writes the result under the name of the module. A module with a function `main`
has options of its own; `--help` lists them.
"""

if __name__ == "__main__":  # before the imports that take long
    from bem._support.interruption import end_on_interrupt

    end_on_interrupt("python -m experiments")

import re
import sys
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

from bem._support.command_line import run_main
from experiments.common import CONFIGS, write_result
from experiments.places import Places, PublishedFolder, ResultsFolder, Take, replaced, with_options_of

HERE = Path(__file__).parent
RUNS = re.compile(r"^def (?:main|study)\(", re.MULTILINE)


def modules() -> dict[str, str]:
    """Module of each study, by the name of the study; modules without `main` or `study` are shared code."""
    files = sorted(path for path in HERE.glob("*/*.py") if RUNS.search(path.read_text(encoding="utf-8")))
    return {path.stem: f"experiments.{path.parent.name}.{path.stem}" for path in files}


def main() -> None:
    """Run the study that the command line names, with the options that follow the name."""
    name, *rest = sys.argv[1:] or [""]
    known = modules()
    if name not in known:
        print(f"python -m experiments: Expected one of {', '.join(known)}; received {name!r}", file=sys.stderr)
        sys.exit(2)
    sys.argv[:] = [f"experiments {name}", *rest]
    module = import_module(known[name])
    called = f"python -m experiments {name}"
    if not hasattr(module, "study"):
        run_main(module.main, program=called, help=module.__doc__)
        return

    def command(
        results: ResultsFolder = Path("results"),
        published: PublishedFolder = Path("published"),
        configs: Annotated[Path, typer.Option(help="Folder of the TOML files of studies.")] = CONFIGS,
        take: Take = None,
        out: Annotated[Path | None, typer.Option(help="Result file to write.")] = None,
        **options: Any,
    ) -> None:
        places = Places(results, published, configs, replaced(take))
        content = module.study(**places.arguments(module.study, name), **options)
        if content is not None:
            write_result(out or places.path(name), name, content)

    run_main(with_options_of(module.study, command), called, program=called, help=module.__doc__)


if __name__ == "__main__":
    main()
