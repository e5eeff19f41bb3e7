"""The command `surrogate export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bem._support.wording import shown
from surrogate.cli.predict import ArchitectureOption, FoundOption


def export(
    name: Annotated[str, typer.Argument(help="fast, accurate, name of a published model, or model directory.")],
    file_format: Annotated[str, typer.Option("--format", help="Format of the file, onnx.")] = "onnx",
    out: Annotated[
        Path | None,
        typer.Option(help="The file. Default: model.onnx in the model directory; fast and accurate need it."),
    ] = None,
    models: FoundOption = None,
    architecture: ArchitectureOption = None,
) -> None:
    """Write a trained model as one ONNX file, from physical inputs to the physical force."""
    from bem._support.outputs import Outputs, require_suffix
    from surrogate.architectures.registry import load_architectures
    from surrogate.inference.model_files import find_model
    from surrogate.pretrained.model import NAMES

    if file_format != "onnx":
        raise ValueError(f"Expected the format onnx. Received: {shown(file_format)}")
    require_suffix(out, (".onnx",))
    if name in NAMES:
        _export_pretrained(name, out, models)
        return
    folder = find_model(name, models, also=NAMES)
    if not folder.is_dir():
        raise ValueError(f"Expected a model directory. Received: {folder}")
    written = folder / "model.onnx" if out is None else out
    load_architectures(architecture or ())
    with Outputs(written) as outputs:
        content = _exported(folder) if out is not None else None
        if content is None:  # needs Keras
            from surrogate.export.onnx import folder_content

            content = folder_content(folder)
        with outputs.write(written) as part:
            part.write_bytes(content)
    typer.echo(f"{written}: {len(content) / 1e6:.2f} MB")


def _export_pretrained(name: str, out: Path | None, models: Path | None) -> None:
    """Write a pretrained model with its inputs F and its bands; this needs no Keras.

    Raises:
        ValueError: no file is given, since `model.onnx` of its directory is the network alone.
    """
    from bem._support.outputs import Outputs
    from surrogate.export.pretrained import file_content
    from surrogate.pretrained.model import Pretrained, find

    folder = find(name, models)
    if out is None:
        raise ValueError(f"Expected --out FILE, since {folder / 'model.onnx'} is the network alone. Received: no --out")
    with Outputs(out) as outputs:
        content = file_content(**Pretrained(folder).parts())
        with outputs.write(out) as part:
            part.write_bytes(content)
    typer.echo(f"{out}: {len(content) / 1e6:.2f} MB")


def _exported(folder: Path) -> bytes | None:
    """Return the ONNX file of a model directory if it belongs to the weights and the scaling; this needs no Keras."""
    from surrogate.inference.model_files import read_run
    from surrogate.inference.onnx_backend import OnnxBackend
    from surrogate.network.onnx_file import ONNX_NAME

    _, scaling = read_run(folder)
    try:
        found = OnnxBackend(folder / ONNX_NAME)
        found.require_weights_of(folder)
        found.require_scaling(scaling)
    except (ValueError, FileNotFoundError):
        return None
    return found.path.read_bytes()
