"""`python -m paper_figures NAME` draws the figure, or writes the table, of a make target's name.

A module has one function, `compose`, whose parameters are the results it shows (`experiments.places`) and which returns
a figure, a table, or several by the names of their files. `--depends FILE` also writes the rule that tells make what
the file was made from.
"""

import inspect
import sys
import tomllib
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

from bem._support.command_line import run_main
from bem._support.outputs import plain_name, write_whole
from experiments.dependencies import Recorder
from experiments.places import Places, keywords, replaced

HERE = Path(__file__).parent
CAPTIONS = HERE / "captions.toml"
KINDS = ("figures", "measurements", "tables")


def modules() -> dict[str, str]:
    """Every target and its module: `figure-5` is `figure_5.py`, whichever folder it stands in."""
    files = sorted(path for kind in KINDS for path in (HERE / kind).glob("*.py") if path.stem != "__init__")
    return {path.stem.replace("_", "-"): f"paper_figures.{path.parent.name}.{path.stem}" for path in files}


def caption(name: str, sources: Sequence[Path]) -> str:
    """The text beside a figure: what is shown, from which data, and what differs from the paper."""
    words = tomllib.loads(CAPTIONS.read_text(encoding="utf-8"))[name]
    data = ", ".join(f"`{source}`" for source in sources)
    parts = {
        "Shown": words["shown"],
        "Data": f"{data}. `python -m paper_figures {name}` draws the figure and writes this text.",
        "Different from the paper": words.get("differs", "The paper has no such figure."),
    }
    lines = [f"**{title}.** {' '.join(text.split())}" for title, text in parts.items()]
    return "\n\n".join([f"# {name.replace('-', ' ').capitalize()}", *lines]) + "\n"


def save(products: Any, name: str, figures: Path, tables: Path) -> list[Path]:
    """Write what a module composed: figures as PDF and PNG, tables as Markdown, CSV and LaTeX.

    Returns:
        where the caption of each figure belongs.
    """
    from paper_figures.style import drawing
    from paper_figures.style.writing import Table

    if not isinstance(products, dict):
        products = {name.removeprefix("table-"): products}
    beside = []
    for stem, product in products.items():
        if isinstance(product, Table):
            product.save(stem, tables)
        else:
            drawing.save(product, stem, figures)
            beside.append(figures / f"{stem}.md")
    return beside


def main(
    context: typer.Context,
    name: Annotated[str, typer.Argument(help="A figure or table, as `make` calls it.")],
    results: Annotated[Path, typer.Option(help="Where results are; figures and tables go there.")] = Path("results"),
    published: Annotated[Path, typer.Option(help="Where published files are.")] = Path("published"),
    take: Annotated[list[str] | None, typer.Option(help="NAME=FILE: read this file instead.")] = None,
    under: Annotated[str | None, typer.Option(help="A folder of its own below figures and tables.")] = None,
    depends: Annotated[Path | None, typer.Option(help="The file of which make is told what it depends on.")] = None,
) -> None:
    """Draw a figure or write a table."""
    known = modules()
    if name not in known:
        raise ValueError(f"Expected one of {', '.join(known)}; received {name!r}")
    recorder = Recorder() if depends else None
    compose = import_module(known[name]).compose
    places = Places(results, published, taken=replaced(take or []))
    arguments = places.arguments(compose, f"make {name}")
    products = compose(**arguments, **keywords(context.args, compose))
    inner = plain_name(under, "--under") if under else ""
    sources = [path for path in map(places.path, arguments) if path.exists()]
    for place in save(products, name, results / "figures" / inner, results / "tables" / inner):
        write_whole(place, caption(name, sources))
    if recorder and depends:
        recorder.add(*(value for value in arguments.values() if isinstance(value, Path) and value.is_file()))
        recorder.write(depends, results, published)


if __name__ == "__main__":
    settings = {"allow_extra_args": True, "ignore_unknown_options": True}
    named = next((f" {word}" for word in sys.argv[1:] if word in modules()), "")
    called = f"python -m paper_figures{named}"
    run_main(main, called, program=called, help=inspect.getdoc(main), context_settings=settings)
