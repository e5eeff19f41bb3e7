"""Export of the pretrained models as ONNX files with everything inside: inputs F, scaling, network and bands.

Inputs, all float64: `times`, `indentations` and `edge` of shape `(batch, steps)`, `tabor` and `modulus_ratio` of shape
`(batch,)`. Output: `force` of shape `(batch, steps)`, float64. Times and indentations must be the measurement steps of
`bem.dataset.physical_steps`, and `edge` is one at the last point of loading and of the dwell, and zero elsewhere.

The metadata of the file are `format`, `format_version`, `name`, `features`, `counts` (JSON: points of loading, dwell
and unloading), `ranges` (JSON: smallest and largest value of each quantity in the training), `scaling` (JSON), `bands`
(JSON: the arrays of `surrogate.pretrained.bands.Bands` and the `levels` of their quantiles) and, as the last entry,
`content_sha256` (see `surrogate.network.onnx_file`).
"""

from __future__ import annotations

import json

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from surrogate.export.inputs_f import RATIO, scaled_inputs
from surrogate.export.onnx import IR_VERSION, OPSET
from surrogate.export.onnx_graph import OnnxGraph
from surrogate.network.onnx_file import PRETRAINED_FORMAT, sealed
from surrogate.pretrained.bands import LEVELS, Bands
from surrogate.pretrained.model import Pretrained

FORMAT_VERSION = 1

_DIGITS = 9  # of float32, which the bands are stored in


def file_content(model: Pretrained) -> bytes:
    """Return the bytes of the ONNX file of a pretrained model."""
    network = onnx.load_model(model.folder / "model.onnx").graph
    network = onnx.compose.add_prefix_graph(network, "network/")
    graph = OnnxGraph()
    inputs = scaled_inputs(graph, model.scaling)
    graph.add("Identity", inputs, output="network/inputs")
    graph.nodes.extend(network.node)
    graph.initializers |= {item.name: numpy_helper.to_array(item) for item in network.initializer}
    scaled = graph.cast(graph.add("Transpose", "network/force", perm=[1, 0]), TensorProto.DOUBLE)
    mean, deviation = model.scaling.force
    scaled = graph.add("Add", graph.add("Mul", scaled, graph.number(deviation)), graph.number(mean))
    graph.symexp(scaled, "force")
    content = helper.make_model(
        graph.finish(model.name, more={RATIO: ["batch"]}),
        opset_imports=[helper.make_opsetid("", OPSET)],
        producer_name="contact-trajectories",
    )
    content.ir_version = IR_VERSION
    helper.set_model_props(content, _metadata(model))
    onnx.checker.check_model(content, full_check=True)
    return sealed(content.SerializeToString(deterministic=True))


def _metadata(model: Pretrained) -> dict[str, str]:
    return {
        "format": PRETRAINED_FORMAT,
        "format_version": str(FORMAT_VERSION),
        "name": model.name,
        "features": model.scaling.features,
        "counts": json.dumps(model.counts.tolist()),
        "ranges": json.dumps(model.ranges),
        "scaling": model.scaling.to_json(),
        "bands": _bands_json(model.bands),
    }


def _bands_json(bands: Bands) -> str:
    arrays = {name: _rounded(values) for name, values in bands.as_arrays().items()}
    return json.dumps({"levels": LEVELS.tolist()} | arrays, separators=(",", ":"))


def _rounded(values: np.ndarray) -> list[float]:
    digits = [float(f"{value:.{_DIGITS}g}") for value in values.ravel()]
    found: list[float] = np.reshape(digits, values.shape).tolist()
    return found
