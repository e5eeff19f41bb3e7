"""One time step of an exported network, whose states are inputs and outputs: what a stream runs.

The step is made from an ONNX file that maps whole histories, without Keras. Each LSTM receives and returns its two
states, and each convolution the window of its last inputs. All other operations of a causal network act on one step at
a time and stay as they are.
"""

from __future__ import annotations

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from surrogate.export.onnx_file import checked_content
from surrogate.export.onnx_graph import OnnxGraph

INPUT, FORCE, NEXT = "inputs", "scaled_force", "/next"
"""Names of the scaled channels and of the scaled force, and the end of the name of a state after the step."""


def step_model(content: bytes, tabor: np.ndarray, name: str) -> bytes:
    """Return the ONNX file of one step of a causal network.

    Args:
        content: ONNX file of `surrogate.export.onnx`: a network alone, or with features and scaling around it.
        tabor: The scaled Tabor parameter, shape `(1, 1)`, float32.
        name: Name of the model in messages.

    Returns:
        A file with the inputs `INPUT`, scaled channels, float32 of shape `(1, 1, width)`, and each state; all states
        begin at zero. Its outputs are `FORCE`, the scaled force of shape `(1,)`, and each state after the step.

    Raises:
        ValueError: the network is not causal.
    """
    graph = onnx.load_model_from_string(content).graph
    weights = {item.name: numpy_helper.to_array(item) for item in graph.initializer}
    nodes, source, force, width = _network(graph, weights, tabor)
    states: dict[str, list[int]] = {}
    step: list[onnx.NodeProto] = []
    for node in nodes:
        if node.op_type == "LSTM":
            units = weights[node.input[2]].shape[-1]
            names = [f"{node.output[0]}/{state}" for state in ("hidden", "cell")]
            states |= {key: [1, 1, units] for key in names}
            node.input.extend(["", *names])
            node.output.extend(state + NEXT for state in names)
        elif node.op_type == "Conv":
            step += _windowed(node, weights, states)
        elif node.op_type == "Reshape":  # of all steps at once: heads of an attention, or dense layers over steps
            raise ValueError(
                "Expected a causal model, whose force does not depend on later steps; use `predict`. "
                f"Received: {name}, which needs the whole history"
            )
        step.append(node)
    weights["step/one"] = np.array([1], dtype=np.int64)
    begin = helper.make_node("Identity", [INPUT], [source])
    made = OnnxGraph()
    made.nodes = [begin, *step, helper.make_node("Reshape", [force, "step/one"], [FORCE])]
    used = {one for node in made.nodes for one in node.input}
    made.initializers = {key: values for key, values in weights.items() if key in used}
    outputs = {FORCE: [1], **{state + NEXT: shape for state, shape in states.items()}}
    return checked_content(made.finish("step", {INPUT: [1, 1, width], **states}, outputs, TensorProto.FLOAT))


def _network(
    graph: onnx.GraphProto, weights: dict[str, np.ndarray], tabor: np.ndarray
) -> tuple[list[onnx.NodeProto], str, str, int]:
    """Return the nodes of the network, the names of its channels and of its scaled force, and the channels' number.

    Around a network, its channels and the Tabor parameter are the only results that are converted to float32, and the
    scaled force is the last one that is converted to float64.
    """
    nodes = list(graph.node)
    if graph.input[0].name == INPUT:
        shape = graph.input[0].type.tensor_type.shape.dim
        graph.node[0].input[0] = "channels"
        force = graph.output[-1].name  # of the causal members, where there are others
        wanted, needed = {force}, []
        for node in reversed(nodes):
            if wanted & set(node.output):
                needed.insert(0, node)
                wanted |= set(node.input)
        return needed, "channels", force, shape[2].dim_value
    casts = [(at, node) for at, node in enumerate(nodes) if node.op_type == "Cast"]
    (_, channels), (begin, told) = [(at, one) for at, one in casts if one.attribute[0].i == TensorProto.FLOAT]
    end, last = casts[-1]
    weights[told.output[0]] = tabor.reshape(-1)
    divided = next(node for node in nodes if node.output[0] == channels.input[0])
    return nodes[begin + 1 : end], channels.output[0], last.input[0], weights[divided.input[1]].size


def _windowed(
    node: onnx.NodeProto, weights: dict[str, np.ndarray], states: dict[str, list[int]]
) -> list[onnx.NodeProto]:
    """Give a convolution its last inputs instead of zeros before the first step; return the nodes that keep them."""
    pads = next(one for one in node.attribute if one.name == "pads")
    past = pads.ints[0]
    if not past:
        return []
    window, seen = f"{node.output[0]}/window", f"{node.output[0]}/seen"
    states[window] = [1, weights[node.input[1]].shape[1], past]
    bounds = {"step/one": [1], "step/far": [np.iinfo(np.int64).max], "step/axis": [2]}
    weights |= {key: np.array(values, dtype=np.int64) for key, values in bounds.items()}
    added = [
        helper.make_node("Concat", [window, node.input[0]], [seen], axis=2),
        helper.make_node("Slice", [seen, *bounds], [window + NEXT]),
    ]
    node.input[0], pads.ints[0] = seen, 0
    return added
