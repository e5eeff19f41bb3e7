"""Diagrams of the models of one user-defined family, from `python -m experiments own_architecture_graphs`."""

from typing import Annotated, Any

import typer
from matplotlib.figure import Figure

from bem._support.outputs import plain_name
from paper_figures.models.figure_architectures import draw_family, ranks
from paper_figures.style import drawing


def compose(
    own_architecture_graphs: Any, *, family: Annotated[str, typer.Option(help="A registered family.")]
) -> dict[str, Figure]:
    """Draw one family.

    Raises:
        ValueError: The result holds no family of that name.
    """
    plain_name(family, "a --family")
    words = own_architecture_graphs["families"].get(family)
    if words is None:
        known = ", ".join(own_architecture_graphs["families"])
        raise ValueError(f"family must be one of {known}; received {family!r}")
    models = own_architecture_graphs["models"].items()
    graphs = {name: graph for name, graph in models if name.rpartition("-")[0] == family}
    deepest = max(row for graph in graphs.values() for row in ranks(graph["layers"]).values())
    drawn = drawing.figure(width=drawing.COLUMN, height=0.34 * (deepest + 2))
    axes = drawn.subplots()
    draw_family(axes, graphs, family, deepest)
    axes.set_title(f"{family}: {words}", loc="left", fontweight="bold")
    return {f"figure-architecture-{family}": drawn}
