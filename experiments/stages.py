"""The stages of the reproduction from scratch and the expected hours of each, printed before each stage begins.

The hours follow from the core seconds stored with the published results: the data set, the result files of the studies
that train, and `run.json` of the models, or their batches if the study `training_speed` measured these on one machine.
A stage with an unpublished part shows an estimate and says so.

Usage: `python -m experiments.stages [NAME] [--published DIR]`.
"""

if __name__ == "__main__":  # before the imports that take long
    from bem._support.interruption import end_on_interrupt

    end_on_interrupt("experiments.stages")

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from bem._support.command_line import run_main
from bem._support.text_files import read_json, read_toml
from experiments import common
from experiments.paper.model_comparison import read_model
from experiments.places import Places
from experiments.trainings.variants import earlier_trainings
from surrogate.architectures.naming import paper_names

CONFIG = common.CONFIGS / "stages.toml"
PUBLISHED = Path("published")


def read_stages() -> dict[str, dict[str, Any]]:
    """Settings of the stages by name, in order, from `experiments/configs/stages.toml`."""
    return read_toml(CONFIG)["stages"]


def core_seconds(name: str, published: Path, labels: Sequence[str] = ()) -> float | None:
    """Core seconds that a stage took according to the published files; `None` if one of them is missing.

    `labels` are the model directories of the stage.
    """
    if labels:
        folders = [published / "models" / label for label in labels]
        if not all((folder / "run.json").is_file() for folder in folders):
            return None
        path = Places(published=published).path("training_speed")
        speed = read_json(path) if path.is_file() else None
        found = [read_model(folder, speed)["core_seconds"] for folder in folders]
        return None if None in found else sum(found)
    if name == "dataset" and (path := published / "dataset.h5").is_file():
        from bem.dataset.sealed_file import open_dataset

        with open_dataset(path) as file:
            return float(file.attrs["core_seconds"])
    path = published / f"{name.replace('-', '_')}.json"
    if name not in ("feature-sets", "data-efficiency") or not path.is_file() or not read_json(path)["complete"]:
        return None
    trained = [one for one in earlier_trainings(path) if "taken_from" not in one]
    return 3600.0 * sum(one["hours"] for one in trained)


def hours_of(name: str, stages: dict[str, dict[str, Any]], published: Path) -> tuple[float, bool]:
    """Hours that a stage takes, and whether they follow from published results (`True`) or are an estimate."""
    stage = stages[name]
    taken = core_seconds(name, published, paper_names() if name == "models" else stage.get("labels", ()))
    return (stage["estimate"] if taken is None else taken / 3600.0) / stage["jobs"], taken is not None


def describe(name: str, stages: dict[str, dict[str, Any]], published: Path = PUBLISHED, hours: bool = True) -> str:
    """One line about a stage: its place, what it does, and its expected hours."""
    said = f"stage {list(stages).index(name) + 1} of {len(stages)}, {name}: {stages[name]['does']}"
    if not hours:
        return said
    expected, measured = hours_of(name, stages, published)
    text = f"{expected:.2g} hours" if expected >= 1.0 else f"{60.0 * expected:.0f} minutes"
    text += "" if measured else " by estimate"
    return f"{said}, about {text}"


def main(
    name: Annotated[str | None, typer.Argument(help="A stage; all of them by default.")] = None,
    published: Annotated[Path, typer.Option(help="Folder of published files.")] = PUBLISHED,
    hours: Annotated[bool, typer.Option(help="Whether to say how long a stage takes.")] = True,
) -> None:
    """Print what each stage does and how long it takes."""
    stages = read_stages()
    if name is not None and name not in stages:
        raise typer.BadParameter(f"expected one of {', '.join(stages)}; received {name!r}")
    for one in [name] if name else stages:
        print(describe(one, stages, published, hours), flush=True)
    if name is None and hours:
        total = sum(hours_of(one, stages, published)[0] for one in stages)
        print(f"about {total:.0f} hours in total on two cores; the same command continues an interrupted run")


if __name__ == "__main__":
    run_main(main)
