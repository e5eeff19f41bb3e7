"""What the exported file of a surrogate asks of a browser and of a microcontroller.

A browser, headless Chromium, runs the file by ONNX Runtime Web on one thread of WebAssembly, as the demonstrator does:
wall milliseconds of one protocol at a time, with features, bands and results. Its forces must be those of Python. This
needs what `make test-demo` installs.

For a microcontroller, which has neither, the file says what a program in C would hold and compute: the bytes of its
weights, and the multiplications with weights that one trajectory needs.
"""

import json
import math
import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import onnx
import typer
from onnx import shape_inference

import surrogate
from experiments.common import MODULUS_RATIO, scenes
from experiments.measurements.cases import STEPS, Hidden
from experiments.measurements.harness import Count
from surrogate.data.features import edge_from_counts
from surrogate.prediction.bands_graph import banded_content
from surrogate.prediction.files import BANDED as NAMES
from surrogate.prediction.predictor import Surrogate

ROUNDS = 15
AGREEMENT = 1e-3
"""Largest difference between forces of the browser and of Python, of their range."""
SCRIPT = Path(__file__).with_suffix(".mjs")
ROOT = Path(__file__).parents[2]


def whole_file(model: Surrogate) -> bytes:
    """The exported file of a model: physical inputs to physical results."""
    return model.network.content() if model.bands is None else banded_content(model)


def inputs_of(model: Surrogate, hidden: Hidden) -> dict[str, np.ndarray]:
    """Inputs of the exported file of a model, by name, a row for each protocol."""
    kind = "physical" if model.name in NAMES else "uniform"
    times, indentations = hidden.grid(kind)
    found = {"times": times, "indentations": indentations, "edge": edge_from_counts(STEPS[kind], len(times))}
    names = ("tabor", "modulus_ratio") if model.name in NAMES else ("tabor",)
    return found | {name: hidden.quantities[name] for name in names}


def network_weights(graph: onnx.GraphProto) -> list[onnx.TensorProto]:
    """The weights of the network, in single precision; features, scaling and bands are in double precision."""
    return [one for one in graph.initializer if one.data_type == onnx.TensorProto.FLOAT]


def multiplications(content: bytes, steps: int) -> int:
    """Multiplications with the weights of the network in one run of a file, for one history of `steps` points."""
    file = onnx.load_model_from_string(content)
    for one in file.graph.input:
        for dimension, size in zip(one.type.tensor_type.shape.dim, (1, steps), strict=False):
            dimension.dim_value = size
    graph = shape_inference.infer_shapes(file, data_prop=True).graph
    sizes = {one.name: [d.dim_value for d in one.type.tensor_type.shape.dim] for one in graph.value_info}
    weights = {one.name: one.dims for one in network_weights(graph)}
    total = 0
    for node in graph.node:
        if node.op_type == "LSTM":  # W and R, once a step
            total += steps * sum(math.prod(weights[name]) for name in node.input[1:3])
        elif node.op_type in ("MatMul", "Gemm", "Conv") and node.input[1] in weights:
            shape = weights[node.input[1]]
            outputs = shape[0 if node.op_type == "Conv" else -1]
            total += math.prod(sizes[node.output[0]]) * math.prod(shape) // outputs
    return total


def in_browser(
    contents: dict[str, bytes], inputs: dict[str, dict[str, np.ndarray]], chromium: str
) -> tuple[str, dict[str, Any]]:
    """Run files in Chromium, each with its inputs.

    Returns:
        The version of the browser, and for each file `milliseconds` of a protocol in every round and `forces`.

    Raises:
        RuntimeError: The browser did not run the files; the message ends with its own last line.
    """
    files = []
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, content) in enumerate(contents.items()):
            path = Path(folder, f"{number}.onnx")
            path.write_bytes(content)
            given = inputs[name].items()
            rows = [
                {key: {"values": values[row].ravel().tolist(), "dims": [1, *values.shape[1:]]} for key, values in given}
                for row in range(len(inputs[name]["tabor"]))
            ]
            files.append({"path": str(path), "inputs": rows})
        question = json.dumps({"rounds": ROUNDS, "files": files})
        done = subprocess.run(["node", SCRIPT, chromium], input=question, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"Chromium did not run the files: {''.join(done.stderr.strip().splitlines()[-1:])}")
    found = json.loads(done.stdout)
    return found["version"], dict(zip(contents, found["answers"], strict=True))


def facts(model: Surrogate, content: bytes, given: dict[str, np.ndarray], answer: dict[str, Any]) -> dict[str, float]:
    """What is published of one model, from its file, the inputs and the browser's answer.

    Raises:
        RuntimeError: The browser's forces differ from Python's.
    """
    solids = scenes(given["tabor"], given.get("modulus_ratio", MODULUS_RATIO))
    expected = model.predict_history(given["times"], given["indentations"], solids)
    differs = np.abs(np.array(answer["forces"]) - expected).max(axis=1) / np.ptp(expected, axis=1)
    if not differs.max() <= AGREEMENT:
        raise RuntimeError(f"forces of {model.name} in the browser differ by {differs.max():.1e} from those of Python")
    weights = network_weights(onnx.load_model_from_string(content).graph)
    steps = given["times"].shape[1]
    return {
        "milliseconds": float(np.median(answer["milliseconds"])),
        "difference": float(differs.max()),  # of the force's range
        "file_bytes": len(content),
        "weights": sum(math.prod(one.dims) for one in weights),
        "multiplications": multiplications(content, steps),
        "steps": steps,
    }


def study(
    *, count: Count = 32, model: Annotated[list[str] | None, typer.Option(help="Models; repeat the option.")] = None
) -> dict[str, Any]:
    """Time the exported files of some models in a browser, and count their weights and multiplications."""
    chromium = os.environ.get("CHROMIUM") or shutil.which("chromium")
    if not (chromium and shutil.which("node") and (ROOT / "demo/node_modules/onnxruntime-web").is_dir()):
        raise RuntimeError("exported_files needs Chromium, Node and their packages; `make test-demo` installs them")
    models = {name: surrogate.load(name) for name in model or [*NAMES, "M1-concat"]}
    hidden = Hidden.draw(count, MODULUS_RATIO)
    contents = {name: whole_file(one) for name, one in models.items()}
    inputs = {name: inputs_of(one, hidden) for name, one in models.items()}
    version, answers = in_browser(contents, inputs, chromium)
    found = {name: facts(one, contents[name], inputs[name], answers[name]) for name, one in models.items()}
    return {"count": count, "browser": f"Chromium {version}", "models": found}
