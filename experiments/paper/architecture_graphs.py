"""The models as graphs of layers, read from the Keras models, so that drawings and models always agree.

For each model: its layers in order of computation, each with its kind, a short label, its width, its number of
parameters and the layers that it reads. The layers `block_1_...` are one, as a block is one box in the paper.
"""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import typer


def label(layer: Any) -> str:
    """Text of a box of the drawing: the kind of the layer and its size."""
    layer_class, config = type(layer).__name__, layer.get_config()
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
    }
    return texts[layer_class]() if layer_class in texts else layer_class


def kind_and_label(operations: list[Any]) -> tuple[str, str]:
    """Kind and text of the box of a layer, or of the layers of a block; the first layer of a block names its kind."""
    box_class, config = type(operations[0]).__name__, operations[0].get_config()
    if len(operations) > 1 and box_class == "Conv1D":
        return "ResidualBlock", f"TCN {config['filters']}, d = {config['dilation_rate'][0]}"
    if len(operations) > 1 and box_class == "MultiHeadAttention":
        return "EncoderBlock", f"Encoder, {config['num_heads']} heads"
    return box_class, label(operations[0])


def box_name(operation: Any) -> str:
    """Name of the box of a layer: that of its block, or its own."""
    return re.sub(r"^(block_\d+)_.*", r"\1", operation.name)


def graph(model: Any) -> dict[str, Any]:
    """Parameters, receptive field in steps (`None` if unlimited) and layers of a functional Keras model."""
    boxes: dict[str, list[Any]] = {}
    for operation in model.operations:
        boxes.setdefault(box_name(operation), []).append(operation)
    layers = []
    for name, operations in boxes.items():
        # Keras 3 has no public interface for the inputs of a layer.
        nodes = [operation._inbound_nodes[0] for operation in operations]
        sources = [box_name(tensor._keras_history.operation) for node in nodes for tensor in node.input_tensors]
        box_class, text = kind_and_label(operations)
        layers.append(
            {
                "name": name,
                "kind": box_class,
                "label": text,
                "width": int(nodes[-1].output_tensors[0].shape[-1]),
                "parameters": sum(int(layer.count_params()) for layer in operations if hasattr(layer, "count_params")),
                "inputs": [source for source in dict.fromkeys(sources) if source != name],
            }
        )
    blocks = [name for name, operations in boxes.items() if kind_and_label(operations)[0] == "ResidualBlock"]
    convolutions = [layer for name in blocks for layer in boxes[name] if type(layer).__name__ == "Conv1D"]
    steps = (layer.dilation_rate[0] * (layer.kernel_size[0] - 1) for layer in convolutions)
    receptive = 1 + sum(steps) if blocks else None
    return {"parameters": int(model.count_params()), "receptive_field": receptive, "layers": layers}


def graphs(names: Iterable[str]) -> dict[str, Any]:
    """Graphs of the named models, with the descriptions of their families."""
    import surrogate
    from surrogate.architectures.naming import FAMILIES, split_name
    from surrogate.data.features import channel_names

    models = {name: graph(surrogate.build(name)) for name in names}
    families = {
        family: FAMILIES[family].description for family in dict.fromkeys(split_name(name)[0] for name in models)
    }
    return {"channels": list(channel_names("D")), "families": families, "models": models}


def study(
    *,
    architecture: Annotated[
        list[str] | None, typer.Option(help="Describe what this file registers instead; repeatable.")
    ] = None,
) -> dict[str, Any]:
    """The graphs of the 18 paper models, or of user-defined architectures."""
    import surrogate
    from surrogate.architectures.naming import is_registered, paper_names
    from surrogate.architectures.registry import load_architectures

    load_architectures([Path(file) for file in architecture or ()])
    own = list(filter(is_registered, surrogate.names()))
    return graphs(own if architecture else paper_names())
