"""Draw a figure or write a table: `python -m paper_figures NAME`, where NAME is that of the make target.

Each module has one function, `compose`. Its parameters are the results that it shows (`experiments.places`). It returns
a figure, a table, or a dictionary of several by the names of their files. The option `--depends FILE` also writes the
make rule of `FILE`: the files from which it was made.
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
KINDS = ("figures", "models", "measurements", "tables")


def modules() -> dict[str, str]:
    """Module of each target, in any of the folders `KINDS`: that of `figure-5` is `figure_5.py`."""
    files = sorted(path for kind in KINDS for path in (HERE / kind).glob("*.py") if path.stem != "__init__")
    return {path.stem.replace("_", "-"): f"paper_figures.{path.parent.name}.{path.stem}" for path in files}


def words_of(name: str) -> dict[str, str]:
    """What `captions.toml` says of a figure.

    Raises:
        ValueError: it says nothing.
    """
    words = tomllib.loads(CAPTIONS.read_text(encoding="utf-8")).get(name, {})
    if "shown" not in words:
        raise ValueError(f"Expected a table [{name}] with a text `shown` in {CAPTIONS}; received none")
    return words


def caption(name: str, sources: Sequence[Path]) -> str:
    """The text beside a figure: what is shown, from which data, and what differs from the paper."""
    words = words_of(name)
    data = ", ".join(f"`{source}`" for source in sources)
    parts = {
        "Shown": words["shown"],
        "Data": f"{data}. `python -m paper_figures {name}` draws the figure and writes this text.",
        "Different from the paper": words.get("differs", "The paper has no such figure."),
    }
    lines = [f"**{title}.** {' '.join(text.split())}" for title, text in parts.items()]
    return "\n\n".join([f"# {name.replace('-', ' ').capitalize()}", *lines]) + "\n"


def save(products: Any, name: str, figures: Path, tables: Path) -> list[Path]:
    """Write the figures as PDF and PNG, and the tables as Markdown, CSV and LaTeX.

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
    name: Annotated[str, typer.Argument(help="Make target of a figure or table.")],
    results: Annotated[Path, typer.Option(help="Folder of results, figures and tables.")] = Path("results"),
    published: Annotated[Path, typer.Option(help="Folder of published files.")] = Path("published"),
    take: Annotated[list[str] | None, typer.Option(help="NAME=FILE: read this file instead.")] = None,
    under: Annotated[str | None, typer.Option(help="Write to this subfolder of figures and tables.")] = None,
    depends: Annotated[Path | None, typer.Option(help="Also write the make rule of this file.")] = None,
) -> None:
    """Draw a figure or write a table."""
    known = modules()
    if name not in known:
        raise ValueError(f"Expected one of {', '.join(known)}; received {name!r}")
    if ".tables." not in known[name]:
        words_of(name)  # before the figure is drawn
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
