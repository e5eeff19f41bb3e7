"""The graphs of your own architectures: those that the files given by `--architecture` register."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from experiments.paper.architecture_graphs import graphs


def study(*, architecture: tuple[str, ...]) -> dict[str, Any]:
    """Load the files, build their models and describe these."""
    import surrogate
    from surrogate.architectures.naming import split_name
    from surrogate.architectures.registry import REGISTERED, load_architectures

    load_architectures([Path(file) for file in architecture])
    return graphs([name for name in surrogate.names() if split_name(name)[0] in REGISTERED])
