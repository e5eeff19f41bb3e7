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
from collections.abc import Mapping, Sequence

import numpy as np
import onnx
from onnx import numpy_helper

from surrogate.data.scaling import Scaling
from surrogate.export.channels import RATIO, scaled_channels
from surrogate.export.onnx_graph import OnnxGraph
from surrogate.network.onnx_file import PRETRAINED_FORMAT, checked_model, sealed

FORMAT_VERSION = 1

_DIGITS = 9  # of float32, which the bands are stored in


def file_content(
    *, name: str, network: bytes, scaling: Scaling, counts: Sequence[int], bands: Mapping[str, np.ndarray]
) -> bytes:
    """Return the bytes of the ONNX file of a pretrained model, from `surrogate.pretrained.model.Pretrained.parts`.

    Args:
        name: Name of the model.
        network: ONNX file from scaled inputs `inputs`, shape `(steps, batch, 13)`, to the scaled force `force`.
        scaling: Scaling of the inputs F and of the force.
        counts: Points of loading, dwell and unloading.
        bands: Arrays of the bands by name, and the `levels` of their quantiles.

    Returns:
        The bytes, with the metadata and the checksum that `surrogate.load` checks.
    """
    inner = onnx.compose.add_prefix_graph(onnx.load_model_from_string(network).graph, "network/")
    graph = OnnxGraph()
    inputs = scaled_channels(graph, scaling, with_tabor=True)
    graph.add("Transpose", inputs, perm=[1, 0, 2], output="network/inputs")
    graph.nodes.extend(inner.node)
    graph.initializers |= {item.name: numpy_helper.to_array(item) for item in inner.initializer}
    graph.unscaled_force(graph.add("Transpose", "network/force", perm=[1, 0]), scaling.force)
    metadata = {
        "format": PRETRAINED_FORMAT,
        "format_version": str(FORMAT_VERSION),
        "name": name,
        "features": scaling.features,
        "counts": json.dumps([int(count) for count in counts]),
        "ranges": json.dumps(scaling.ranges),
        "scaling": scaling.to_json(),
        "bands": json.dumps({key: _rounded(values) for key, values in bands.items()}, separators=(",", ":")),
    }
    content = checked_model(graph.finish(name, more={RATIO: ["batch"]}), metadata)
    return sealed(content.SerializeToString(deterministic=True))


def _rounded(values: np.ndarray) -> list[float]:
    digits = [float(f"{value:.{_DIGITS}g}") for value in values.ravel()]
    found: list[float] = np.reshape(digits, values.shape).tolist()
    return found
