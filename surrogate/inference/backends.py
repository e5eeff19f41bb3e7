"""What computes a prediction: ONNX Runtime, which starts at once, or Keras, which can be differentiated.

Both map times, indentations and edge marks of shape `(batch, steps)` and Tabor parameters of shape `(batch,)` to forces
of shape `(batch, steps)`, all physical and float64.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import json
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from bem._support.wording import shortened
from surrogate.architectures import build
from surrogate.architectures.registry import require_source
from surrogate.backend import import_keras
from surrogate.data.features import channels
from surrogate.data.scaling import Scaling
from surrogate.export.graph import Operation, Plan
from surrogate.export.onnx_seal import is_intact

if TYPE_CHECKING:
    import keras
    import onnxruntime

# Larger batches leave the caches and gain nothing.
ONNX_BATCH = 256

TRAINING_EXTRA = "Keras is not installed; install it with `pip install 'contact-trajectories[train]'`"

ONNX_FORMAT = "viscoelastic-contact-surrogate-onnx"
ONNX_FORMAT_VERSION = 1
ONNX_NAME = "model.onnx"

ONNX_METADATA = ("name", "architecture", "features", "ranges", "scaling", "plan", "dataset_sha256", "weights_sha256")
ONNX_INTERFACE = [
    ("times", "tensor(double)", 2),
    ("indentations", "tensor(double)", 2),
    ("tabor", "tensor(double)", 1),
    ("edge", "tensor(double)", 2),
    ("force", "tensor(double)", 2),
]
"""Inputs and the output: name, type and number of axes."""


class Backend(Protocol):
    """What a `surrogate.Surrogate` needs of whatever computes its forces."""

    name: str
    scaling: Scaling

    def force(self, times: np.ndarray, indentations: np.ndarray, tabor: np.ndarray, edge: np.ndarray) -> np.ndarray:
        """Return the physical forces of shape `(batch, steps)`."""
        ...

    def plan(self) -> Plan:
        """Return the network as elementary operations."""
        ...


class OnnxBackend:
    """An ONNX file of `surrogate export`, run by ONNX Runtime.

    Args:
        path: The file.
        threads: Threads ONNX Runtime may use; one is best for single trajectories.

    Raises:
        FileNotFoundError: no such file.
        ValueError: the file is not of `surrogate export`, of another version of it or altered since, or there is no
            thread to use.
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
            raise self._unlike("which is another one, damaged, or of an earlier version; export it again")
        try:
            self.session = self._session()
            self.metadata = dict(self.session.get_modelmeta().custom_metadata_map)
        # ONNX Runtime's exceptions share no base class of their own.
        except Exception as error:
            raise self._unlike("unreadable") from error
        found = self.metadata.get("format"), self.metadata.get("format_version")
        if found[0] != ONNX_FORMAT:
            raise self._unlike("which is not one")
        if found[1] != str(ONNX_FORMAT_VERSION):
            raise ValueError(
                f"Expected version {ONNX_FORMAT_VERSION} of the ONNX files of `surrogate export`. "
                f"Received: version {shortened(str(found[1]))} in {self.path}"
            )
        missing = [key for key in ONNX_METADATA if key not in self.metadata]
        if missing:
            raise self._unlike(f"without {', '.join(missing)} in its metadata")
        interface = [
            (item.name, item.type, len(item.shape))
            for item in (*self.session.get_inputs(), *self.session.get_outputs())
        ]
        if sorted(interface) != sorted(ONNX_INTERFACE):
            names = shortened(", ".join(name for name, _, _ in interface))
            raise self._unlike(f"whose inputs and outputs ({names}) are other ones")
        self.name = self.metadata["name"]
        self._operations = self._read_operations()
        try:
            self.scaling = Scaling.from_json(self.metadata["scaling"], source=self.path)
        except (ValueError, RecursionError) as error:
            raise self._unlike("whose scaling is damaged") from error

    def _session(self) -> onnxruntime.InferenceSession:
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = self.threads
        options.inter_op_num_threads = 1
        options.log_severity_level = 4
        return onnxruntime.InferenceSession(self._content, sess_options=options, providers=["CPUExecutionProvider"])

    def __getstate__(self) -> dict[str, Any]:
        """Return what another process needs, where the file may be missing: its content, and not the session."""
        return {name: value for name, value in vars(self).items() if name != "session"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self.session = self._session()

    def _read_operations(self) -> list[Operation]:
        try:
            operations = [Operation.from_dict(entry) for entry in json.loads(self.metadata["plan"])]
            if not operations:
                raise ValueError("no operations")
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise self._unlike("whose plan is damaged") from error
        return operations

    def _unlike(self, words: str) -> ValueError:
        return ValueError(f"Expected an ONNX file of `surrogate export`. Received: {self.path}, {words}")

    def force(self, times: np.ndarray, indentations: np.ndarray, tabor: np.ndarray, edge: np.ndarray) -> np.ndarray:
        """Return the physical forces of shape `(batch, steps)`.

        Raises:
            ValueError: ONNX Runtime cannot compute them, as where attention over a long history exceeds the memory.
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

    def plan(self) -> Plan:
        """Return the network as elementary operations, read from the file."""
        import onnx

        graph = onnx.load_model_from_string(self._content).graph
        names = tuple(f"{operation.name}/" for operation in self._operations)
        weights = {
            item.name: onnx.numpy_helper.to_array(item) for item in graph.initializer if item.name.startswith(names)
        }
        return Plan(self._operations, weights)

    def require_weights_of(self, folder: Path) -> None:
        """Check that the file was exported from the weights beside it, where there are any.

        Raises:
            ValueError: it was not.
        """
        weights = folder / "model.weights.h5"
        if weights.is_file() and hashlib.sha256(weights.read_bytes()).hexdigest() != self.metadata["weights_sha256"]:
            raise ValueError(
                f"Expected the weights that {self.path} was exported from; restore them, or export it again with "
                f"`surrogate export {shortened(self.name)}`. Received: other weights in {weights}"
            )

    def require_scaling(self, scaling: Scaling) -> None:
        """Check that the file was exported with the scaling beside it.

        Raises:
            ValueError: it was not.
        """
        if scaling != self.scaling:
            raise ValueError(
                f"Expected the scaling that {self.path} was exported with; export it again with `surrogate export "
                f"{shortened(self.name)}`, or restore scaling.json. Received: another one beside it"
            )


def require_exported(folder: Path, scaling: Scaling) -> None:
    """Check a model directory's weights and scaling against its ONNX file, where there is an intact one.

    Raises:
        ValueError: they differ.
    """
    if not (folder / ONNX_NAME).is_file():
        return
    try:
        exported = OnnxBackend(folder / ONNX_NAME)
    except ValueError:
        # A file that must be exported again says nothing about what is beside it.
        return
    exported.require_weights_of(folder)
    exported.require_scaling(scaling)


class KerasBackend:
    """A Keras model with its scaling.

    Args:
        model: A model of `surrogate.build`, trained.
        scaling: The scaling of its training set.
        name: The name shown in messages.
    """

    def __init__(self, model: keras.Model, scaling: Scaling, name: str = "surrogate") -> None:
        self.model = model
        self.scaling = scaling
        self.name = name

    def __reduce__(self) -> tuple[Any, ...]:
        return _keras_backend, (self.model.get_config(), self.model.get_weights(), self.scaling, self.name)

    def force(self, times: np.ndarray, indentations: np.ndarray, tabor: np.ndarray, edge: np.ndarray) -> np.ndarray:
        """Return the physical forces of shape `(batch, steps)`."""
        sequence = self.scaling.scale_channels(channels(times, indentations, edge, self.scaling.features))
        return self.force_from_channels(sequence, self.scaling.scale_tabor(tabor))

    def force_from_channels(self, sequence: np.ndarray, tabor: np.ndarray) -> np.ndarray:
        """Return the physical forces of scaled channels `(batch, steps, channels)` and scaled Tabor `(batch, 1)`."""
        from surrogate.training.loop import predict_scaled

        return self.scaling.unscale_force(predict_scaled(self.model, sequence, tabor))

    @cached_property
    def _plan(self) -> Plan:
        from surrogate.export.graph import lower

        return lower(self.model)

    def plan(self) -> Plan:
        """Return the network as elementary operations."""
        return self._plan


def _keras_backend(config: dict[str, Any], weights: list[np.ndarray], scaling: Scaling, name: str) -> KerasBackend:
    """Build a backend again from what was pickled."""
    import_keras()
    import keras

    # Their layers are known to Keras once they are imported.
    importlib.import_module("surrogate.architectures.blocks")
    importlib.import_module("surrogate.architectures.layers")
    model = keras.Model.from_config(config)
    model.set_weights(weights)
    return KerasBackend(model, scaling, name)


def keras_model(folder: Path, run: dict[str, Any]) -> keras.Model:
    """Build the model a directory's `run.json` names and read its weights.

    Raises:
        FileNotFoundError: the weights are missing.
        ModuleNotFoundError: Keras is not installed.
        ValueError: they do not fit, or the architecture is not known here as it was.
    """
    if importlib.util.find_spec("keras") is None:
        raise ModuleNotFoundError(f"{TRAINING_EXTRA}, or load with backend='onnx'", name="keras")
    from surrogate.inference.model_files import existing
    from surrogate.inference.weights import load_weights

    require_source(run)
    model = build(run["architecture"], features=run["features"])
    load_weights(model, existing(folder / "model.weights.h5"))
    return model
