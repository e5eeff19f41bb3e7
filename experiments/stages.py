"""The stages of the paper from nothing, and the hours to expect of each: printed up front and as each begins.

Usage: `python -m experiments.stages [NAME]`; the hours are in `experiments/configs/stages.toml`.
"""

from __future__ import annotations

import tomllib
from typing import Annotated, Any

import typer

from experiments import studies

CONFIG = studies.CONFIGS / "stages.toml"


def read_stages() -> dict[str, dict[str, Any]]:
    """Stages by name, in order."""
    return tomllib.loads(CONFIG.read_text(encoding="utf-8"))["stages"]


def describe(name: str, stages: dict[str, dict[str, Any]], *, with_hours: bool = True) -> str:
    """One line about a stage."""
    place = list(stages).index(name) + 1
    if not with_hours:
        return f"stage {place} of {len(stages)}, {name}"
    hours = stages[name]["hours"]
    expected = f"{hours:g} hours" if hours >= 1.0 else f"{60.0 * hours:.0f} minutes"
    return f"stage {place} of {len(stages)}, {name}: {stages[name]['does']}, about {expected}"


def main(
    name: Annotated[str | None, typer.Argument(help="A stage; all of them by default.")] = None,
    hours: Annotated[bool, typer.Option(help="Say what it does and how long that takes.")] = True,
) -> None:
    """Say what a stage does and how long it takes."""
    stages = read_stages()
    if name is not None and name not in stages:
        raise typer.BadParameter(f"expected one of {', '.join(stages)}; received {name!r}")
    for one in [name] if name else stages:
        print(describe(one, stages, with_hours=hours), flush=True)
    if name is None:
        total = sum(stage["hours"] for stage in stages.values())
        print(f"about {total:.0f} hours in all on two cores; interrupt at will, the same command goes on", flush=True)


if __name__ == "__main__":
    typer.run(main)
