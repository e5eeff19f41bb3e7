"""The table of docs/reproducing.md: what each figure and table shows."""

from bem._support.wording import markdown_table
from paper_figures.__main__ import captions


def targets() -> str:
    """Every figure and table with its title, in the order of `captions.toml`."""
    rows = [[f"`make {name}`", entry["title"]] for name, entry in captions().items() if "title" in entry]
    return markdown_table(["Target", "Shows"], rows)
