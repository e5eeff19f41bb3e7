"""Run one study: `python -m experiments NAME INPUT ... --out FILE`; `NAME --help` lists its inputs and options.

A study is a function `study` of the module NAME, or `study_NAME` of any module. It is a command of Typer that returns
the content of its result, or `None` for nothing to write. The result is written to `--out`, by default
`results/NAME.json`. With `--leave-out` a study is left out where a package that it needs is not installed; with
`--busy` the seconds of a busy machine are published, too.
"""

if __name__ == "__main__":  # before the imports that take long
    from bem._support.interruption import end_on_interrupt

    end_on_interrupt("python -m experiments")

import argparse
import re
import shlex
import sys
from functools import wraps
from importlib import import_module
from pathlib import Path
from typing import Any

from bem._support.command_line import run_main
from bem._support.wording import listed

HERE = Path(__file__).parent


def studies() -> dict[str, str]:
    """Module of each study, by the name of the study; modules without a study are shared code."""
    modules = {}
    for path in HERE.glob("*/*.py"):
        for name in re.findall(r"^def study(?:_(\w+))?\(", path.read_text(encoding="utf-8"), flags=re.MULTILINE):
            modules[name or path.stem] = f"experiments.{path.parent.name}.{path.stem}"
    return dict(sorted(modules.items()))


def main() -> None:
    """Run the study that the command line names, and write what it returns."""
    name, *arguments = sys.argv[1:] or [""]
    modules = studies()
    if name in ("-h", "--help"):
        print(f"{__doc__}\nStudies: {', '.join(modules)}")
        return
    if name not in modules:
        text = f"study must be one of {listed(modules, name)}; received {name!r}"
        print(f"python -m experiments: {text}", file=sys.stderr)
        sys.exit(2)
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--out", type=Path, default=Path("results", f"{name}.json"))
    for flag in ("--busy", "--leave-out"):
        parser.add_argument(flag, action="store_true")
    shared, own = parser.parse_known_args(arguments)
    module, program = import_module(modules[name]), f"python -m experiments {name}"
    study = getattr(module, f"study_{name}", None) or module.study

    @wraps(study)
    def command(**inputs: Any) -> None:
        from experiments.harness import publish

        try:
            result = study(**inputs)
        except ModuleNotFoundError as error:
            lacking = f"{name} needs {error.name}, which this installation leaves out; run `make setup` first"
            if not shared.leave_out:
                raise RuntimeError(lacking) from error
            print(f"left out: {lacking}")
            return
        if result is not None:
            publish(shared.out, shlex.join([name, *own]), result, busy=shared.busy)

    sys.argv[:] = [program, *own]
    run_main(command, program, program=program, help=module.__doc__)


if __name__ == "__main__":
    main()
