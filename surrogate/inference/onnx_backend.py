"""Prediction by ONNX Runtime, which starts quickly and needs no deep-learning framework."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from bem._support.wording import shortened
from surrogate.data.scaling import Scaling
from surrogate.inference.model_files import weights_sha256
from surrogate.network.graph import Graph, Operation
from surrogate.network.onnx_file import (
    ONNX_FORMAT,
    ONNX_FORMAT_VERSION,
    ONNX_INTERFACE,
    ONNX_METADATA,
    ONNX_NAME,
    PRETRAINED_FORMAT,
    is_intact,
    session_of,
)

ONNX_BATCH = 256
"""Trajectories in a batch. A larger batch does not fit into the caches and is not faster."""


class OnnxBackend:
    """An ONNX file of `surrogate export`, run by ONNX Runtime.

    Args:
        path: The file.
        threads: Number of threads of ONNX Runtime; one is best for single trajectories.

    Raises:
        FileNotFoundError: the file does not exist.
        ValueError: the file is not of `surrogate export`, is of another version of it, or was altered since; or the
            number of threads is below one.
    """

    def __init__(self, path: str | Path, threads: int = 1) -> None:
        self.path = Path(path)
        self.threads = threads
        if not self.path.is_file():
            where = "is a directory" if self.path.is_dir() else "does not exist"
            raise FileNotFoundError(f"Expected an ONNX file. Received: {self.path}, which {where}")
        if threads < 1:
            raise ValueError(f"Expected at least one thread. Received: threads={threads}")
        self._content = self.path.read_bytes()
        if not is_intact(self._content):
            raise self._unlike("which is not one, is damaged, or is of an earlier version; export it again")
        try:
            self.session = session_of(self._content, threads)
            self.metadata = dict(self.session.get_modelmeta().custom_metadata_map)
        # ONNX Runtime's exceptions share no base class of their own.
        except Exception as error:
            raise self._unlike("which ONNX Runtime cannot read") from error
        found = self.metadata.get("format"), self.metadata.get("format_version")
        if found[0] == PRETRAINED_FORMAT:
            name = shortened(self.metadata.get("name", ""))
            raise self._unlike(f"which holds the pretrained model {name} for other programs; load it by its name")
        if found[0] != ONNX_FORMAT:
            raise self._unlike("which is not one")
        if found[1] != str(ONNX_FORMAT_VERSION):
            raise ValueError(
                f"Expected version {ONNX_FORMAT_VERSION} of the ONNX files of `surrogate export`. "
                f"Received: version {shortened(str(found[1]))} in {self.path}"
            )
        missing = [key for key in ONNX_METADATA if key not in self.metadata]
        if missing:
            raise self._unlike(f"whose metadata lack {', '.join(missing)}")
        interface = [
            (item.name, item.type, len(item.shape))
            for item in (*self.session.get_inputs(), *self.session.get_outputs())
        ]
        if sorted(interface) != sorted(ONNX_INTERFACE):
            names = shortened(", ".join(name for name, _, _ in interface))
            raise self._unlike(f"whose inputs and outputs ({names}) are not those of `surrogate export`")
        self.name = self.metadata["name"]
        self._operations = self._read_operations()
        try:
            self.scaling = Scaling.from_json(self.metadata["scaling"], source=self.path)
        except (ValueError, RecursionError) as error:
            raise self._unlike("whose scaling is damaged") from error

    def __getstate__(self) -> dict[str, Any]:
        """Return the state to pickle: the content of the file, which another process may lack, not the session."""
        return {name: value for name, value in vars(self).items() if name != "session"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self.session = session_of(self._content, self.threads)

    def _read_operations(self) -> list[Operation]:
        try:
            operations = [Operation.from_dict(entry) for entry in json.loads(self.metadata["plan"])]
            if not operations:
                raise ValueError("no operations")
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise self._unlike("whose operations are damaged") from error
        return operations

    def _unlike(self, words: str) -> ValueError:
        return ValueError(f"Expected an ONNX file of `surrogate export`. Received: {self.path}, {words}")

    def force(self, times: np.ndarray, indentations: np.ndarray, tabor: np.ndarray, edge: np.ndarray) -> np.ndarray:
        """Return the physical forces of shape `(batch, steps)`.

        Raises:
            ValueError: ONNX Runtime cannot compute them, for example because attention over a long history exceeds
                the memory.
        """
        inputs = {"times": times, "indentations": indentations, "tabor": tabor, "edge": edge}
        inputs = {name: np.ascontiguousarray(values, dtype=np.float64) for name, values in inputs.items()}
        try:
            parts = [
                self.session.run(["force"], {name: values[at : at + ONNX_BATCH] for name, values in inputs.items()})[0]
                for at in range(0, len(times), ONNX_BATCH)
            ]
        except Exception as error:
            raise ValueError(
                f"Expected histories that {self.name} can compute. Received: shape {np.shape(times)} "
                f"({shortened(str(error))})"
            ) from error
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def graph(self) -> Graph:
        """Return the network as a graph of elementary operations, read from the file."""
        import onnx

        content = onnx.load_model_from_string(self._content).graph
        names = tuple(f"{operation.name}/" for operation in self._operations)
        weights = {
            item.name: onnx.numpy_helper.to_array(item) for item in content.initializer if item.name.startswith(names)
        }
        return Graph(self._operations, weights)

    def require_weights_of(self, folder: Path) -> None:
        """Check that the file was exported from the weights in a model directory, if there are any.

        Raises:
            ValueError: it was exported from other weights.
        """
        weights = folder / "model.weights.h5"
        if weights.is_file() and weights_sha256(folder) != self.metadata["weights_sha256"]:
            raise ValueError(
                f"Expected the weights that {self.path} was exported from; restore them, or export it again with "
                f"`surrogate export {shortened(self.name)}`. Received: other weights in {weights}"
            )

    def require_scaling(self, scaling: Scaling) -> None:
        """Check that the file was exported with a scaling.

        Raises:
            ValueError: it was exported with another scaling.
        """
        if scaling != self.scaling:
            raise ValueError(
                f"Expected the scaling that {self.path} was exported with; export it again with `surrogate export "
                f"{shortened(self.name)}`, or restore scaling.json. Received: another scaling in scaling.json"
            )


def require_exported(folder: Path, scaling: Scaling) -> None:
    """Check the weights and the scaling of a model directory against its ONNX file, if there is an intact one.

    Raises:
        ValueError: the ONNX file was exported from other weights or with another scaling.
    """
    if not (folder / ONNX_NAME).is_file():
        return
    try:
        exported = OnnxBackend(folder / ONNX_NAME)
    except ValueError:
        # A damaged or outdated file says nothing about the other files.
        return
    exported.require_weights_of(folder)
    exported.require_scaling(scaling)
