"""Graphs of user-defined architectures: those registered by the files that `--architecture` names."""

from pathlib import Path
from typing import Annotated, Any

import typer

from experiments.paper.architecture_graphs import graphs


def study(
    *, architecture: Annotated[list[str], typer.Option(help="File that registers architectures; repeatable.")]
) -> dict[str, Any]:
    """Load the files, and build and describe the models that they register."""
    import surrogate
    from surrogate.architectures.naming import split_name
    from surrogate.architectures.registry import REGISTERED, load_architectures

    load_architectures([Path(file) for file in architecture])
    return graphs([name for name in surrogate.names() if split_name(name)[0] in REGISTERED])
