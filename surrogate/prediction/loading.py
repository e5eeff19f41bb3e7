"""From the name or the path of a trained model to the predictor, by way of the checks of its files.

Every ONNX file has a checksum and those of files beside it (`surrogate.export.onnx_file`), which are checked first.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from bem._support.text_files import read_json
from bem._support.validation import whole_number
from bem._support.wording import shortened, shown
from surrogate.data.scaling import Scaling
from surrogate.export import onnx_file
from surrogate.prediction.bands import Bands
from surrogate.prediction.files import BANDED, BANDED_FILES, WEIGHTS, existing, find_model, read_run
from surrogate.prediction.networks import Network, OnnxNetwork, keras_network
from surrogate.prediction.predictor import Surrogate

BACKENDS = ("onnx", "keras")
MOST_THREADS = 1024
EXPORTED = "an ONNX file of `surrogate export`"


def load(name: str | Path, root: str | Path | None = None, *, backend: str = "onnx", threads: int = 1) -> Surrogate:
    """Load a trained model.

    Args:
        name: `"fast"` or `"accurate"`, which know any standard linear solid and their own uncertainty; name of a
            published model, path of a model directory that `surrogate train` wrote (`./NAME` in the working
            directory), or path of an ONNX file that `surrogate export` wrote.
        root: Directory that is searched for names. By default `published` of the repository, then `published` of the
            working directory, then the models packaged with an installation.
        backend: `"onnx"`, which starts quickly and needs no deep-learning framework, or `"keras"`, whose model can be
            differentiated.
        threads: Number of threads of ONNX Runtime. The environment determines the threads of Keras.

    Returns:
        A `Surrogate`. Its `predict(scene, protocol)` returns a trajectory, or a list of them for many, of `"fast"` and
        `"accurate"` with bands; `predict_history(times, indentations, scene)` returns forces; and `stream(scene)`
        starts a step-by-step prediction.

    Raises:
        FileNotFoundError: the model directory or one of its files does not exist.
        ModuleNotFoundError: Keras is not installed, and the backend is `"keras"`.
        ValueError: the name or the backend is unknown, a file is damaged, the weights do not fit the model or are not
            finite, or the ONNX file was exported from other weights or with another scaling.
    """
    if backend not in BACKENDS:
        raise ValueError(f"Expected a backend of {', '.join(BACKENDS)}. Received: backend={shown(backend)}")
    threads = whole_number("threads", threads, low=1, high=MOST_THREADS)
    place = find_model(name, root)
    if name in BANDED or (place / "bands.npz").is_file():
        if backend != "onnx":
            raise ValueError(f"Expected the backend 'onnx' for {name}, whose card has errors. Received: {backend!r}")
        return load_banded(place, threads)
    return Surrogate(_network(place, backend, threads))


def load_banded(folder: Path, threads: int = 1) -> Surrogate:
    """Load the folder of a model with bands, `fast` or `accurate`.

    Raises:
        FileNotFoundError: a file is missing.
        ValueError: a file is damaged.
    """
    for name in BANDED_FILES:
        existing(folder / name)
    path = folder / onnx_file.ONNX_NAME
    remedy = f"get {folder} again (`git restore`, or another installation), or train it by `make pretrained`"
    content, session, sums = _read_sealed(path, threads, "a network of `make pretrained`", remedy)
    _require_beside(path, sums, remedy)
    try:
        if missing := [name for key, name in onnx_file.BESIDE.items() if name in BANDED_FILES and key not in sums]:
            raise ValueError(f"no sum of {', '.join(missing)}")
        scaling, run = Scaling.load(folder / "scaling.json"), read_json(folder / "run.json")
        network = OnnxNetwork(content, scaling, folder.name, threads, session)
        if session.get_inputs()[0].shape[2] != len(scaling.channel_mean) + 1:
            raise ValueError(f"a network of the inputs {session.get_inputs()[0].shape}")
        loading, dwell, unloading = map(int, run["counts"])
        if (steps := run.get("steps")) is not None:  # without this entry, a network reads all of them
            network.steps = [whole_number("steps", one, low=0, high=loading + dwell + unloading - 1) for one in steps]
        with np.load(folder / "bands.npz") as arrays:
            bands = Bands(**{name: arrays[name].astype(np.float64) for name in arrays.files})
        if bands.shape.shape[1] != loading + dwell + unloading:
            raise ValueError(f"bands of {bands.shape.shape[1]} steps")
    except Exception as error:  # of a sealed folder that another program wrote; the libraries raise many kinds
        raise ValueError(
            f"Expected a folder of `make pretrained`; {remedy}. Received: {path}, whose folder has "
            f"other files ({shortened(str(error))})"
        ) from error
    return Surrogate(network, steps="physical", counts=(loading, dwell, unloading), bands=bands)


def _network(place: Path, backend: str, threads: int) -> Network:
    """Return the network of a model directory or an ONNX file."""
    if place.is_file():
        if backend != "onnx":
            raise ValueError(f"Expected a model directory for the {backend} backend. Received: {place}")
        return _exported(place, threads)[0]
    run, scaling = read_run(place)
    path, found = place / onnx_file.ONNX_NAME, None
    try:
        found, sums = _exported(path, threads) if path.is_file() else (None, {})
    except ValueError:
        # A damaged or outdated file says nothing about the other files.
        if backend == "onnx":
            raise
    if found is not None:
        again = f"export it again with `surrogate export {shortened(found.name)}`"
        _require_beside(path, sums, again)
        if found.scaling != scaling:
            raise ValueError(
                f"Expected the scaling that {path} was exported with; {again}, or restore scaling.json. "
                "Received: another scaling in scaling.json"
            )
    if backend == "keras":
        return keras_network(place, run, scaling)
    if found is None:
        existing(place / WEIGHTS)
        raise FileNotFoundError(
            f"Expected {path.name} in {place}; write it with `surrogate export {place}`, or choose the backend keras. "
            "Received: no such file"
        )
    return found


def _exported(path: Path, threads: int) -> tuple[OnnxNetwork, dict[str, str]]:
    """Return an ONNX file of `surrogate export`, and its metadata."""
    content, session, metadata = _read_sealed(path, threads, EXPORTED, "export it again")
    found, version = metadata.get("format"), metadata.get("format_version")
    words, cause = "", None
    if found == onnx_file.PRETRAINED_FORMAT:
        name = shortened(metadata.get("name", ""))
        words = f"which holds the pretrained model {name} for other programs; load it by its name"
    elif found != onnx_file.ONNX_FORMAT:
        words = "which is not one"
    elif version != str(onnx_file.ONNX_FORMAT_VERSION):
        words = f"which is of version {shortened(str(version))}, not {onnx_file.ONNX_FORMAT_VERSION}"
    else:
        try:
            scaling = Scaling.from_json(metadata["scaling"], source=path)
            return OnnxNetwork(content, scaling, metadata["name"], threads, session), metadata
        except (KeyError, ValueError) as error:
            words, cause = "which another program wrote", error
    raise ValueError(f"Expected {EXPORTED}. Received: {path}, {words}") from cause


def _read_sealed(path: Path, threads: int, expected: str, remedy: str) -> tuple[bytes, Any, dict[str, str]]:
    """Return the content of a file with a checksum, its session and its metadata; messages have the words."""
    if not path.is_file():
        where = "is a directory" if path.is_dir() else "does not exist"
        raise FileNotFoundError(f"Expected {expected}. Received: {path}, which {where}")
    content = path.read_bytes()
    if not onnx_file.is_intact(content):
        words = f"which is not one, is damaged, or is of an earlier version; {remedy}"
        raise ValueError(f"Expected {expected}. Received: {path}, {words}")
    try:
        session = onnx_file.session_of(content, threads)
        return content, session, dict(session.get_modelmeta().custom_metadata_map)
    # ONNX Runtime's exceptions share no base class of their own.
    except Exception as error:
        raise ValueError(f"Expected {expected}. Received: {path}, which ONNX Runtime cannot read") from error


def _require_beside(path: Path, metadata: dict[str, str], remedy: str) -> None:
    """Check the files beside an ONNX file against the sums in its metadata; a file that is missing is not checked."""
    for key, beside in ((key, path.with_name(name)) for key, name in onnx_file.BESIDE.items() if key in metadata):
        if beside.is_file() and onnx_file.sha256(beside) != metadata[key]:
            raise ValueError(
                f"Expected the {beside.name} that {path} was written with; restore it, or {remedy}. "
                f"Received: {beside}, which is damaged or another file"
            )
