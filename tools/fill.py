"""Write numbers from results into documents, so that none is typed by hand.

A place in a document reads `<!-- fill MODULE.FUNCTION INPUT ... -->...<!-- end -->`. The function returns its text from
the contents of these files of the repository (`experiments.common.read_input`).

Usage: `python tools/fill.py [DOCUMENT ...] [--check]`, by default for every document.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import re
from importlib import import_module
from typing import Annotated

import typer

from bem._support.command_line import run_main
from experiments.common import read_input

ROOT = Path(__file__).resolve().parents[1]
PLACE = re.compile(r"(<!-- fill ([a-z0-9_.]+)((?: [\w./-]+)*) -->\n*).*?(\n*<!-- end -->)", re.DOTALL)
DOCUMENTS = ("*.md", "docs/*.md", "bem/*.md")


def text_of(name: str, inputs: list[str]) -> str:
    """The text that a function gives of its inputs, paths from the root of the repository.

    Raises:
        ValueError: No function of `experiments` or `paper_figures` has this name.
        FileNotFoundError: A result that the function reads does not exist; the message names the command that makes it.
    """
    module, _, function = name.rpartition(".")
    try:
        if module.partition(".")[0] not in ("experiments", "paper_figures"):
            raise ImportError(module)
        text_function = getattr(import_module(module), function)
    except (ImportError, AttributeError) as error:
        raise ValueError(f"a place must name a function of experiments or paper_figures; received {name!r}") from error
    return str(text_function(*(read_input(ROOT / path) for path in inputs)))


def filled(text: str) -> str:
    """A document with the text of every place renewed; blank lines within a place are kept."""
    return PLACE.sub(lambda match: match[1] + text_of(match[2], match[3].split()) + match[4], text)


def documents() -> list[Path]:
    """Every document that has a place."""
    paths = [path for pattern in DOCUMENTS for path in sorted(ROOT.glob(pattern))]
    return [path for path in paths if PLACE.search(path.read_text(encoding="utf-8"))]


def main(
    names: Annotated[list[Path] | None, typer.Argument(metavar="DOCUMENT", help="Markdown files.")] = None,
    check: Annotated[bool, typer.Option("--check", help="Change nothing; fail if a document is out of date.")] = False,
) -> None:
    """Fill the places of documents."""
    stale = []
    for document in names or documents():
        text = document.read_text(encoding="utf-8")
        if (updated := filled(text)) != text:
            stale.append(document)
            if check:
                print(f"fill: {document} is out of date; run `python tools/fill.py {document}`", file=sys.stderr)
            else:
                document.write_text(updated, encoding="utf-8")
    if check and stale:
        raise typer.Exit(1)


if __name__ == "__main__":
    run_main(main, "fill")
