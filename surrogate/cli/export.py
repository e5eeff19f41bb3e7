"""The command `surrogate export`."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from bem._support.wording import shown
from surrogate.cli.predict import ArchitectureOption, FoundOption
from surrogate.prediction.files import BANDED


def export(
    name: Annotated[str, typer.Argument(help="fast, accurate, name of a published model, or model directory.")],
    file_format: Annotated[
        str | None, typer.Option("--format", help="onnx or keras. Default: by the name of the file.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="The file. Default: model.onnx in the model directory; fast, accurate and keras need it."),
    ] = None,
    models: FoundOption = None,
    architecture: ArchitectureOption = None,
) -> None:
    """Write a trained model as one file.

    An .onnx file maps physical inputs to the physical force. A .keras file maps scaled inputs to the scaled force;
    `keras.saving.load_model` reads it after `import surrogate`.
    """
    import surrogate
    from bem._support.outputs import Outputs, require_suffix
    from surrogate.architectures.registry import load_architectures
    from surrogate.prediction.files import find_model
    from surrogate.prediction.loading import load_banded

    if file_format not in (None, "onnx", "keras"):
        raise ValueError(f"Expected the format onnx or keras. Received: {shown(file_format)}")
    require_suffix(out, (".onnx", ".keras") if file_format is None else (f".{file_format}",))
    as_keras = out.suffix == ".keras" if out is not None else file_format == "keras"
    if name in BANDED and as_keras:
        raise ValueError(f"Expected the format onnx for {name}. Received: the format keras")
    folder = find_model(name, models)
    if not folder.is_dir():
        raise ValueError(f"Expected a model directory. Received: {folder}")
    if out is None and as_keras:
        raise ValueError("Expected --out FILE.keras. Received: no --out")
    if out is None and name in BANDED:
        raise ValueError(f"Expected --out FILE, since {folder / 'model.onnx'} is the network alone. Received: no --out")
    load_architectures(architecture or ())
    written = folder / "model.onnx" if out is None else out
    with Outputs(written) as outputs:
        if as_keras:
            model = surrogate.load(folder, backend="keras").model
            with outputs.write(written) as part:
                model.save(part)
        else:
            content = None
            if folder.name in BANDED:
                from surrogate.prediction.bands_graph import banded_content

                content = banded_content(load_banded(folder))
            elif out is not None:  # the present file, which takes no Keras, if it belongs to the others
                with suppress(ValueError, FileNotFoundError):
                    content = surrogate.load(folder).network.content()
            if content is None:
                from surrogate.training.exporting import folder_content

                content = folder_content(folder)
            with outputs.write(written) as part:
                part.write_bytes(content)
    typer.echo(f"{written}: {written.stat().st_size / 1e6:.2f} MB")
