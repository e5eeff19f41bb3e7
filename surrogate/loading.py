"""From the name or the path of a trained model to the predictor, by way of the checks of its files.

Every file of a model directory has a checksum in `run.json`, which is compared first (`surrogate.files`); an
ONNX file of `surrogate export` has its own (`surrogate.onnx.file`).
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal, overload

from bem._support.validation import whole_number
from bem._support.wording import shown
from surrogate.data.scaling import Scaling
from surrogate.files import STAGES, WEIGHTS, existing, find_model, read_intact, read_run
from surrogate.model import Surrogate
from surrogate.networks import Network, OnnxNetwork, keras_network
from surrogate.onnx import file as onnx_file

if TYPE_CHECKING:
    from surrogate.solids import SolidSurrogate

BACKENDS = ("onnx", "keras")
MOST_THREADS = 1024
FORMAT = (onnx_file.ONNX_FORMAT, str(onnx_file.ONNX_FORMAT_VERSION))
EXPORTED = "the file must be an ONNX file of `surrogate export`"


@overload
def load(  # type: ignore[overload-overlap]  # a text that is not known may be this one
    name: Literal["fast", "accurate"], root: str | Path | None = None
) -> SolidSurrogate: ...
@overload
def load(name: str | Path, root: str | Path | None = None, *, backend: str = "onnx", threads: int = 1) -> Surrogate: ...
def load(
    name: str | Path, root: str | Path | None = None, *, backend: str = "onnx", threads: int = 1
) -> Surrogate | SolidSurrogate:
    """Load a trained model.

    Args:
        name: `"fast"` or `"accurate"`, which know any linear solid and their own uncertainty; name of a published model
            of the paper, path of a model directory that `surrogate train` wrote (`./NAME` in the working directory), or
            path of an ONNX file that `surrogate export` wrote.
        root: Directory that is searched for names. By default `published` of the repository, then `published` of the
            working directory, then the models packaged with an installation.
        backend: `"onnx"`, which starts quickly and needs no deep-learning framework, or `"keras"`, whose model can be
            differentiated.
        threads: Number of threads of ONNX Runtime. The environment determines the threads of Keras.

    Returns:
        A `Surrogate`; of `"fast"` and `"accurate"` a `SolidSurrogate` (`surrogate.solids`). `predict(scene, protocol)`
        returns a trajectory, or a list of them for many, those of a `SolidSurrogate` with intervals and bands;
        `predict_history(times, indentations, scene)` of a `Surrogate` returns forces.

    Raises:
        FileNotFoundError: the model directory or one of its files does not exist.
        ModuleNotFoundError: Keras is not installed, and the backend is `"keras"`.
        ValueError: the name or the backend is unknown, a file is damaged or of another model, or the weights do not fit
            the model or are not finite.
    """
    if backend not in BACKENDS:
        raise ValueError(f"backend must be one of {', '.join(BACKENDS)}; received {shown(backend)}")
    threads = whole_number("threads", threads, low=1, high=MOST_THREADS)
    source = find_model(name, root)
    if (source / STAGES).is_file():
        if backend != "onnx":
            raise ValueError(f"backend must be 'onnx' for {source.name}, which NumPy evaluates; received {backend!r}")
        from surrogate.solids import SolidSurrogate  # it compiles kernels

        return SolidSurrogate.load(source)
    return Surrogate(_network(source, backend, threads))


def _network(source: Path, backend: str, threads: int) -> Network:
    """Return the network of a model directory or an ONNX file."""
    if source.is_file():
        if backend != "onnx":
            raise ValueError(f"name must be a model directory for the backend {backend}; received {source}")
        return _exported(source, threads)
    run, scaling = read_run(source)
    if backend == "keras":
        return keras_network(source, run, scaling)
    path = source / onnx_file.ONNX_NAME
    if not path.is_file():
        existing(source / WEIGHTS)
        raise FileNotFoundError(
            f"{path.name} must be in {source}: write it with `surrogate export {source}`, or choose the backend "
            "keras; received no such file"
        )
    return OnnxNetwork(read_intact(path, run), scaling, run["name"], threads)


def _exported(path: Path, threads: int) -> OnnxNetwork:
    """Return an ONNX file of `surrogate export`, which states its own checksum."""
    file_bytes = path.read_bytes()
    session = onnx_file.session_of(file_bytes, threads) if onnx_file.is_intact(file_bytes) else None
    metadata = session.get_modelmeta().custom_metadata_map if session else {}
    if (metadata.get("format"), metadata.get("format_version")) != FORMAT:
        reason = f"which is not one, is damaged, or is not of version {FORMAT[1]}; export it again"
        raise ValueError(f"{EXPORTED}; received {path}, {reason}")
    scaling = Scaling.from_json(metadata["scaling"], source=path)
    return OnnxNetwork(file_bytes, scaling, metadata["name"], threads, session)
