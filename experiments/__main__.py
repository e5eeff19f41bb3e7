"""Run one study: `python -m experiments NAME ...`.

A study is a function `study_NAME`, or `study` of the module NAME, which returns the content of one result, or `None`
for nothing to write. The runner supplies the arguments of the function, as `experiments.places` describes, each with an
option that names another file, and writes the result under its name; what `stated` keeps of the options is the command
that the result states.
"""

if __name__ == "__main__":  # before the imports that take long
    from bem._support.interruption import end_on_interrupt

    end_on_interrupt("python -m experiments")

from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import typer

from experiments import places


def command_of(module: ModuleType, name: str) -> Any:
    """The command of a study, which publishes what it returns."""
    study = getattr(module, f"study_{name}", None) or module.study

    def command(
        results: places.ResultsFolder = Path("results"),
        published: places.PublishedFolder = Path("published"),
        configs: Annotated[Path, typer.Option(help="Folder of the TOML files of studies.")] = places.CONFIGS,
        out: Annotated[Path | None, typer.Option(help="Result file to write.")] = None,
        busy: Annotated[bool, typer.Option("--busy", help="Publish seconds of a busy machine, too.")] = False,
        leave_out: places.LeaveOut = False,
        **options: Any,
    ) -> None:
        from experiments.measurements.harness import publish, stated

        files = places.Places(results, published, configs, places.taken(study, options) | ({name: out} if out else {}))
        own = {one: options[one] for one in places.options_of(study)}  # in the order of the study
        try:
            content = study(**files.arguments(study, name), **own)
        except ModuleNotFoundError as error:
            lacking = f"{name} needs {error.name}, which this installation leaves out; run `make setup` first"
            if not leave_out:
                raise RuntimeError(lacking) from error
            print(f"left out: {lacking}")
            return
        if content is not None:
            publish(files.path(name), " ".join([name, *stated(own)]), content, busy=busy)

    return places.with_options(command, study)


def main() -> None:
    """Run the study that the command line names."""
    places.run_named("experiments", places.studies(), command_of)


if __name__ == "__main__":
    main()
