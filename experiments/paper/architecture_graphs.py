"""The models as graphs of layers, read from the Keras models, so that drawings and models always agree.

For each model: its layers in order of computation, each with its kind, a short label, its width, its number of
parameters and the layers that it reads.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import typer


def label(layer: Any) -> str:
    """Text of a box of the drawing: the kind of the layer and its size."""
    kind, config = type(layer).__name__, layer.get_config()
    texts = {
        "InputLayer": lambda: "history" if layer.name == "sequence" else "Tabor",
        "LSTM": lambda: f"LSTM {config['units']}",
        "Dense": lambda: f"Dense {config['units']}" + (", ReLU" if config["activation"] == "relu" else ""),
        "Conv1D": lambda: f"Conv {config['filters']}, {config['kernel_size'][0]} pt",
        "LayerNormalization": lambda: "LayerNorm",
        "Add": lambda: "Add",
        "AppendTabor": lambda: "Concat",
        "FiLM": lambda: "FiLM",
        "TaborGate": lambda: "Gate",
        "ResidualTCNBlock": lambda: f"TCN {config['filters']}, d = {config['dilation']}",
        "EncoderBlock": lambda: f"Encoder, {config['heads']} heads",
    }
    return texts[kind]() if kind in texts else kind


def graph(model: Any) -> dict[str, Any]:
    """Parameters, receptive field in steps (`None` if unlimited) and layers of a functional Keras model."""
    layers = []
    for operation in model.operations:
        # Keras 3 has no public interface for the inputs of a layer.
        node = operation._inbound_nodes[0]
        layers.append(
            {
                "name": operation.name,
                "kind": type(operation).__name__,
                "label": label(operation),
                "width": int(node.output_tensors[0].shape[-1]),
                "parameters": int(operation.count_params()) if hasattr(operation, "count_params") else 0,
                "inputs": [tensor._keras_history.operation.name for tensor in node.input_tensors],
            }
        )
    blocks = [operation for operation in model.operations if type(operation).__name__ == "ResidualTCNBlock"]
    receptive = 1 + sum(2 * (one.kernel_size - 1) * one.dilation for one in blocks) if blocks else None
    return {"parameters": int(model.count_params()), "receptive_field": receptive, "layers": layers}


def graphs(names: Iterable[str]) -> dict[str, Any]:
    """Graphs of the named models, with the descriptions of their families."""
    import surrogate
    from surrogate.architectures.naming import FAMILIES, split_name
    from surrogate.data.features import channel_names

    models = {name: graph(surrogate.build(name)) for name in names}
    families = {family: FAMILIES[family] for family in dict.fromkeys(split_name(name)[0] for name in models)}
    return {"channels": list(channel_names("D")), "families": families, "models": models}


def study(
    *,
    architecture: Annotated[
        list[str] | None, typer.Option(help="Describe what this file registers instead; repeatable.")
    ] = None,
) -> dict[str, Any]:
    """The graphs of the 18 paper models, or of user-defined architectures."""
    import surrogate
    from surrogate.architectures.naming import paper_names, split_name
    from surrogate.architectures.registry import REGISTERED, load_architectures

    load_architectures([Path(file) for file in architecture or ()])
    own = [name for name in surrogate.names() if split_name(name)[0] in REGISTERED]
    return graphs(own if architecture else paper_names())
