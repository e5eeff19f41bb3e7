"""Tables of docs/reproducing.md: what each figure and table shows, and the hours of a reproduction from scratch."""

from pathlib import Path
from typing import Any

from bem._support.wording import markdown_table
from experiments.stages import hours_of, read_stages
from paper_figures.__main__ import captions


def targets() -> str:
    """Every figure and table with its title, in the order of `captions.toml`."""
    rows = [[f"`make {name}`", words["title"]] for name, words in captions().items() if "title" in words]
    return markdown_table(["Target", "Shows"], rows)


def stages(published: Path) -> str:
    """What each stage of the reproduction from scratch does, and its hours; `e` marks an estimate."""
    known = read_stages()
    hours = {name: hours_of(name, known, published) for name in known}
    rows = [
        [f"`make {name}`", known[name]["does"], f"{value:.2g}{'' if sure else ' e'}"]
        for name, (value, sure) in hours.items()
    ]
    return markdown_table(["Stage", "Does", "Hours"], rows, "llr")


def figure_minutes(target_minutes: Any) -> str:
    """Minutes of all figures and tables."""
    return f"{target_minutes['minutes']['figures tables']:.0f}"


def minutes(target_minutes: Any) -> str:
    """Minutes of all figures and tables, and of the small run from scratch, as they were measured."""
    spent = target_minutes["minutes"]
    return (
        f"All figures and tables take {spent['figures tables']:.1f} minutes, the report included {spent['paper']:.1f}, "
        f"and `make smoke` {spent['smoke']:.1f}, on {target_minutes['host']}"
    )
