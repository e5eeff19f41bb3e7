"""The pretrained model `fast` as the browser demonstrator evaluates it: one file of numbers, `demo/public/fast.bin`.

The file is one line of JSON, filled with spaces to a multiple of four bytes, and then little-endian float32. The line
holds scaling, ranges and counts of points, the measurement steps whose channels enter the network, and name and shape
of each array. The arrays are kernel and bias of the dense layers, in order, with the exact GELU between them, and those
of `surrogate.intervals.Bands`, the quantiles at `COVERAGE` only. `demo/src/fast.ts` reads it.

Usage: `python -m experiments.demo_model`.
"""

if __name__ == "__main__":  # before the imports that take long
    from bem._support.interruption import end_on_interrupt

    end_on_interrupt("experiments.demo_model")

import json
from pathlib import Path

import numpy as np
import onnx
from onnx import numpy_helper

import surrogate
from bem._support.command_line import run_main
from bem._support.outputs import write_whole
from surrogate.intervals import Bands
from surrogate.model import Surrogate

NAME = "fast"
OUT = Path("demo/public/fast.bin")
COVERAGE = 0.9
OPERATIONS = {"Transpose", "Gather", "Reshape", "MatMul", "Add", "Mul", "Erf", "Squeeze"}
"""Those of dense layers with GELU on the channels of some steps: the page evaluates no other network."""


def packed(model: Surrogate) -> bytes:
    """Return the file of a model.

    Raises:
        ValueError: the model has no bands, or a network of other operations.
    """
    bands, graph = model.bands, onnx.load_model_from_string(model.network.content()).graph
    if not isinstance(bands, Bands) or (found := {node.op_type for node in graph.node}) - OPERATIONS:
        raise ValueError(f"model must have bands and dense layers only; received {model.name}")
    assert found >= {"Gather", "Erf"}
    values = {item.name: numpy_helper.to_array(item) for item in graph.initializer}
    steps = next(values[node.input[1]] for node in graph.node if node.op_type == "Gather")
    kernels = [name for name in values if name.endswith("/kernel")]
    layers = [values[name.replace("kernel", part)] for name in kernels for part in ("kernel", "bias")]
    arrays = {f"layer_{place}": layer for place, layer in enumerate(layers)}
    arrays |= {name: getattr(bands, name) for name in ("ranges", "coefficients", "edges", "shape")}
    arrays["quantiles"] = bands.quantiles_at(COVERAGE)
    scaling = model.scaling
    head = {
        "format": "contact-demo-model",
        "name": model.name,
        "counts": list(model.counts),
        "steps": steps.tolist(),
        "mean": [*scaling.channel_mean, scaling.tabor[0]],
        "deviation": [*scaling.channel_scale, scaling.tabor[1]],
        "force": scaling.force,
        "ranges": scaling.ranges,
        "arrays": {name: array.shape for name, array in arrays.items()},
    }
    line = json.dumps(head).encode()
    line += b" " * (-(len(line) + 1) % 4) + b"\n"
    return line + b"".join(np.asarray(array, dtype="<f4").tobytes() for array in arrays.values())


def main() -> None:
    """Write the file."""
    OUT.parent.mkdir(parents=True, exist_ok=True)
    write_whole(OUT, packed(surrogate.load(NAME)))
    print(f"{OUT}: {OUT.stat().st_size} bytes")


if __name__ == "__main__":
    run_main(main)
