"""Draw a figure or write a table: `python -m paper_figures NAME`, where NAME is that of the make target.

The function of a target has its name: `figure_5` is that of `figure-5`. Its parameters are the results that it shows
(`experiments.places`). It returns a figure, a table, or a dictionary of several by the names of their files.
"""

if __name__ == "__main__":  # before the imports that take long
    from bem._support.interruption import end_on_interrupt

    end_on_interrupt("python -m paper_figures")

import re
import tomllib
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import typer

from bem._support.outputs import plain_name, write_whole
from experiments.places import LeaveOut, Places, PublishedFolder, ResultsFolder, run_named, taken, with_options

HERE = Path(__file__).parent
CAPTIONS = HERE / "captions.toml"
TARGETS = re.compile(r"^def ((?:figure|table)_\w+|graphical_abstract)\(", re.MULTILINE)


def modules() -> dict[str, str]:
    """Module of each target, in the order of the names."""
    found = {}
    for path in (path for kind in ("figures", "measurements") for path in (HERE / kind).glob("*.py")):
        for name in TARGETS.findall(path.read_text(encoding="utf-8")):
            found[name.replace("_", "-")] = f"paper_figures.{path.parent.name}.{path.stem}"
    return dict(sorted(found.items()))


def function_of(name: str) -> Callable[..., Any]:
    """The function of a target."""
    function: Callable[..., Any] = getattr(import_module(modules()[name]), name.replace("-", "_"))
    return function


def captions() -> dict[str, dict[str, str]]:
    """The title of each figure and table, and the text beside each figure, in the order of the paper."""
    return tomllib.loads(CAPTIONS.read_text(encoding="utf-8"))


def words_of(name: str) -> dict[str, str]:
    """What `captions.toml` says of a figure.

    Raises:
        ValueError: it says nothing.
    """
    words = captions().get(name, {})
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
    """Write the figures as PDF and PNG, and the tables as Markdown, CSV and LaTeX; print where one of each is.

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
            print(tables / f"{stem}.md")
        else:
            drawing.save(product, stem, figures)
            print(figures / f"{stem}.pdf")
            beside.append(figures / f"{stem}.md")
    return beside


def command_of(_: ModuleType, name: str) -> Any:
    """The command of a figure or a table, which writes what its function returns."""
    compose = function_of(name)

    def command(
        results: ResultsFolder = Path("results"),
        published: PublishedFolder = Path("published"),
        under: Annotated[str | None, typer.Option(help="Write to this subfolder of figures and tables.")] = None,
        leave_out: LeaveOut = False,
        **options: Any,
    ) -> None:
        if not name.startswith("table-"):
            words_of(name)  # before the figure is drawn
        places = Places(results, published, taken=taken(compose, options))
        try:
            arguments = places.arguments(compose, name)
            products = compose(**arguments, **options)
        except FileNotFoundError as error:
            if not leave_out:
                raise
            print(f"{name} is left out: {error}")
            return
        inner = plain_name(under, "--under") if under else ""
        sources = [path for path in map(places.path, arguments) if path.exists()]
        for place in save(products, name, results / "figures" / inner, results / "tables" / inner):
            write_whole(place, caption(name, sources))

    command.__doc__ = compose.__doc__
    return with_options(command, compose)


def main() -> None:
    """Draw the figure or write the table that the command line names."""
    run_named("paper_figures", modules(), command_of)


if __name__ == "__main__":
    main()
