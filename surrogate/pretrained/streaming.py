"""Step-by-step prediction with a pretrained model, for control loops on any standard linear solid.

`Pretrained.stream` returns a stream with the methods of `surrogate.inference.streaming.Stream`. The models learned from
the physical measurement steps of a planned protocol (`bem.dataset.physical_steps.physical_grid`): take these steps.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from surrogate.inference.streaming import Stream
from surrogate.pretrained.network import graph_of

if TYPE_CHECKING:
    from surrogate.pretrained.model import Pretrained


class PretrainedStream(Stream):
    """Prediction that advances point by point; `Pretrained.stream` returns one.

    Args:
        model: The pretrained model.
        tabor: The Tabor parameter of the history.
        modulus_ratio: Relaxed over instantaneous modulus of its solid.
    """

    def __init__(self, model: Pretrained, *, tabor: float, modulus_ratio: float) -> None:
        graph = graph_of(model.folder / "model.onnx")
        super().__init__(graph, model.scaling, tabor=tabor, modulus_ratio=modulus_ratio, name=model.name)
