"""Draw a figure or write a table: `python -m paper_figures NAME INPUT ... --out FILE`, NAME being its make target.

Each module has one function, `compose`, of the contents of its inputs in their order (`experiments.common.read_input`).
It returns a figure, a table, or a dictionary of several by the names of their files. With `--leave-out` what lacks an
input is left out.
"""

if __name__ == "__main__":  # before the imports that take long
    from bem._support.interruption import end_on_interrupt

    end_on_interrupt("python -m paper_figures")

import tomllib
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

from bem._support.command_line import run_main
from bem._support.outputs import write_whole
from experiments.common import read_input

HERE = Path(__file__).parent
CAPTIONS = HERE / "captions.toml"
KINDS = ("figures", "models", "measurements", "tables")


def modules() -> dict[str, str]:
    """Module of each target, in any of the folders `KINDS`: that of `figure-5` is `figure_5.py`."""
    files = sorted(path for folder in KINDS for path in (HERE / folder).glob("*.py") if path.stem != "__init__")
    return {path.stem.replace("_", "-"): f"paper_figures.{path.parent.name}.{path.stem}" for path in files}


def captions() -> dict[str, dict[str, str]]:
    """The title of each figure and table, and the text beside each figure, in the order of the paper."""
    return tomllib.loads(CAPTIONS.read_text(encoding="utf-8"))


def words_of(name: str) -> dict[str, str]:
    """What `captions.toml` says of a figure.

    Raises:
        ValueError: it says nothing.
    """
    entry = captions().get(name, {})
    if "shown" not in entry:
        raise ValueError(f"Expected a table [{name}] with a text `shown` in {CAPTIONS}; received none")
    return entry


def caption(name: str, sources: Sequence[Path]) -> str:
    """The text beside a figure: what is shown, from which data, and what differs from the paper."""
    entry = words_of(name)
    data = ", ".join(f"`{source}`" for source in sources)
    parts = {
        "Shown": entry["shown"],
        "Data": f"{data}. `make {name}` draws the figure and writes this text.",
        "Different from the paper": entry.get("differs", "The paper has no such figure."),
    }
    lines = [f"**{title}.** {' '.join(text.split())}" for title, text in parts.items()]
    return "\n\n".join([f"# {name.replace('-', ' ').capitalize()}", *lines]) + "\n"


def save(products: Any, out: Path) -> list[Path]:
    """Write the figures as PDF and PNG, and the tables as Markdown, CSV and LaTeX; print where one of each is.

    Args:
        products: A figure or a table, or a dictionary of several by the names of their files.
        out: The file of a single one; several lie in its folder, or in the folders `figures` and `tables` beside it.

    Returns:
        Where the caption of each figure belongs.
    """
    from paper_figures.style import drawing
    from paper_figures.style.writing import Table

    captioned = []
    for stem, product in (products if isinstance(products, dict) else {out.stem: products}).items():
        subfolder = "tables" if isinstance(product, Table) else "figures"
        folder = out.parent.with_name(subfolder) if out.parent.name in ("figures", "tables") else out.parent
        if isinstance(product, Table):
            product.save(stem, folder)
            print(folder / f"{stem}.md")
        else:
            drawing.save(product, stem, folder)
            print(folder / f"{stem}.pdf")
            captioned.append(folder / f"{stem}.md")
    return captioned


def main(
    name: Annotated[str, typer.Argument(help="Name of the figure or table, as `make help-all` lists them.")],
    inputs: Annotated[list[Path], typer.Argument(help="Files and folders that it shows, in the order of its rule.")],
    out: Annotated[Path, typer.Option(help="File to write: *.pdf of a figure, *.md of a table.")],
    family: Annotated[str | None, typer.Option(help="The one family of `figure-architectures` to draw.")] = None,
    leave_out: Annotated[bool, typer.Option("--leave-out", help="Leave out what lacks an input.")] = False,
) -> None:
    """Draw a figure or write a table."""
    if name not in modules():
        raise ValueError(f"the name must be one of {', '.join(modules())}; received {name!r}")
    if not name.startswith("table-"):
        words_of(name)  # before the figure is drawn
    compose = import_module(modules()[name]).compose
    try:
        products = compose(*map(read_input, inputs), **({"family": family} if family else {}))
    except FileNotFoundError as error:
        if not leave_out:
            raise
        print(f"{name} is left out: {error}")
        return
    for path in save(products, out):
        write_whole(path, caption(name, inputs))


if __name__ == "__main__":
    run_main(main, "python -m paper_figures", program="python -m paper_figures")
