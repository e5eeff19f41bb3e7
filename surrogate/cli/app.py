"""The command line `surrogate`: list, train, evaluate, predict, export."""

from __future__ import annotations

import shlex
import sys
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from bem import __version__
from bem._support.command_line import HELP_NAMES, add_version, run_command
from bem._support.interruption import say_what_is_kept
from bem._support.outputs import Outputs, require_suffix
from bem._support.wording import shown
from surrogate.architectures.naming import split_name
from surrogate.architectures.registry import load_architectures
from surrogate.backend import import_keras, limit_threads
from surrogate.cli.predict import ArchitectureOption, FoundOption, predict
from surrogate.cli.predict_si import UnitGroup, predict_si
from surrogate.files import PRETRAINED, find_model, model_roots, read_intact, read_run, write_run
from surrogate.onnx.file import ONNX_NAME
from surrogate.training.model_directory import model_name, require_place
from surrogate.training.stopping import STOPPED, stop_request

app = typer.Typer(
    cls=UnitGroup,
    context_settings=HELP_NAMES,
    rich_markup_mode="markdown",
    help="Sequence models that imitate the contact solver.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

add_version(app, "surrogate", __version__)

DatasetOption = Annotated[Path, typer.Option(help="Data set file.")]
RecipeOption = Annotated[str, typer.Option(help="A recipe's name (paper, swift) or a TOML file.")]
RunsOption = Annotated[Path, typer.Option(help="Directory of the runs. A file called STOP in it stops them.")]
ModelsOption = Annotated[Path, typer.Option(help="Directory in which finished models are published.")]
EpochsOption = Annotated[int | None, typer.Option(help="Number of epochs. Default: the recipe's.")]
ThreadsOption = Annotated[int | None, typer.Option(help="Number of threads. Default: the backend's.")]
SeedOption = Annotated[int | None, typer.Option(help="Seed of weights, batches and dropout. Default: the recipe's.")]

DATASET = Path("published/dataset.h5")
RUNS = Path("results/training")
MODELS = Path("published/models")


@app.command("list")
def list_models(
    models: FoundOption = None,
    markdown: Annotated[bool, typer.Option(help="Print the table of docs/surrogate-models.md.")] = False,
    architecture: ArchitectureOption = None,
) -> None:
    """List the published models with their errors, best first, the untrained models, and the installed software."""
    from surrogate.cli.tables import installed, model_table, parameter_table

    load_architectures(architecture or ())
    if markdown:
        typer.echo(parameter_table())
        return
    typer.echo(model_table(model_roots(models)))
    typer.echo(installed())


@app.command()
def train(
    name: Annotated[str, typer.Argument(help="Name of an architecture; `surrogate list` shows them.")],
    recipe: RecipeOption = "swift",
    dataset: DatasetOption = DATASET,
    features: Annotated[str, typer.Option(help="Feature set, A to D.")] = "D",
    epochs: EpochsOption = None,
    seed: SeedOption = None,
    split_seed: Annotated[int, typer.Option(help="Seed of the split into training, validation and test set.")] = 0,
    fraction: Annotated[float, typer.Option(help="Fraction of the training set to use.")] = 1.0,
    fold: Annotated[int, typer.Option(help="Number of the nested family of such fractions.")] = 0,
    extra: Annotated[Path | None, typer.Option(help="A second data set, for training only.")] = None,
    label: Annotated[str | None, typer.Option(help="Name to publish the model under.")] = None,
    architecture: ArchitectureOption = None,
    replace: Annotated[bool, typer.Option(help="Replace a published model.")] = False,
    threads: ThreadsOption = None,
    runs: RunsOption = RUNS,
    models: ModelsOption = MODELS,
) -> None:
    """Train one model, or resume its training, and publish it at the end."""
    say_what_is_kept("completed epochs are saved, and the same command continues")
    out = models / (model_name(name, "an architecture's name") if label is None else model_name(label, "a --label"))
    if not architecture:
        split_name(name)
    changed = {"features": features != "D", "split-seed": split_seed, "fraction": fraction != 1.0, "extra": extra}
    otherwise = [f"--{option}" for option, value in changed.items() if value]
    if otherwise and label is None and models == MODELS:
        raise ValueError(
            f"--label must be given with {', '.join(otherwise)}, because {out} is for the model trained with the "
            "defaults of these options; received none"
        )
    require_place(out)
    if threads is not None:
        limit_threads(threads)
    load_architectures(architecture or ())
    from surrogate.data.dataset import TrajectoryDataset
    from surrogate.training.interface import train as train_model

    data = TrajectoryDataset.load(dataset)
    published = train_model(
        name,
        data,
        out=out,
        recipe=recipe,
        seed=seed,
        epochs=epochs,
        features=features,
        split=data.split(split_seed).with_fraction(fraction, fold),
        extra=extra,
        runs=runs,
        replace=replace,
        should_stop=stop_request(runs),
        log=typer.echo,
        command=shlex.join(["surrogate", *sys.argv[1:]]),
    )
    if not published:
        raise typer.Exit(STOPPED)


@app.command()
def evaluate(
    name: Annotated[str, typer.Argument(help="Name of a published model, or folder (./NAME).")],
    dataset: DatasetOption = DATASET,
    models: FoundOption = None,
    architecture: ArchitectureOption = None,
    errors: Annotated[Path | None, typer.Option(help="CSV file for the errors of each trajectory.")] = None,
    threads: ThreadsOption = None,
) -> None:
    """Print the errors of a trained model on its test set."""
    if threads is not None:
        limit_threads(threads)
    import_keras()
    load_architectures(architecture or ())
    from surrogate.data.metrics import summary
    from surrogate.loading import load
    from surrogate.training.evaluation import evaluate_published, write_errors

    with Outputs(errors) as outputs:
        trained = load(name, models, backend="keras")
        indices, test_errors = evaluate_published(trained, find_model(name, models), dataset)
        if errors is not None:
            with outputs.write(errors) as temporary:
                write_errors(temporary, indices, test_errors)
    for quantity, values in summary(test_errors).items():
        numbers = "  ".join(f"{statistic} {value:.3e}" for statistic, value in values.items())
        typer.echo(f"{quantity:<30} {numbers}")
    if errors is not None:
        typer.echo(outputs.sentence)


app.command()(predict)
app.command("predict-si")(predict_si)


@app.command()
def export(
    name: Annotated[str, typer.Argument(help="Name of a published model of the paper, or folder (./NAME).")],
    file_format: Annotated[
        str | None, typer.Option("--format", help="onnx or keras. Default: by the name of the file.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="The file. Default: model.onnx in the model directory; .keras needs it."),
    ] = None,
    models: FoundOption = None,
    architecture: ArchitectureOption = None,
) -> None:
    """Write a trained model as one file.

    An .onnx file maps physical inputs to the physical force. A .keras file maps scaled inputs to the scaled force;
    `keras.saving.load_model` reads it after `import surrogate.architectures.layers`.
    """
    import surrogate

    if file_format not in (None, "onnx", "keras"):
        raise ValueError(f"--format must be onnx or keras; received {shown(file_format)}")
    require_suffix(out, (".onnx", ".keras") if file_format is None else (f".{file_format}",))
    as_keras = out.suffix == ".keras" if out is not None else file_format == "keras"
    if name in PRETRAINED:
        raise ValueError(
            f"NAME must be a model of the paper's kind; received {name}, whose features are integrals along the "
            "protocol: it has no ONNX file"
        )
    folder = find_model(name, models)
    if not folder.is_dir():
        raise ValueError(f"NAME must be a model directory; received {folder}")
    if out is None and as_keras:
        raise ValueError("--out must name the file for .keras; received no --out")
    load_architectures(architecture or ())
    written = folder / ONNX_NAME if out is None else out
    with Outputs(written) as outputs:
        if as_keras:
            model = surrogate.load(folder, backend="keras").model
            with outputs.write(written) as temporary:
                model.save(temporary)
        else:
            model_bytes = None
            if out is not None:  # the present file, which takes no Keras, if it belongs to the others
                with suppress(ValueError, FileNotFoundError):
                    model_bytes = read_intact(folder / ONNX_NAME, read_run(folder)[0])
            if model_bytes is None:
                import_keras()
                from surrogate.training.runs import folder_content

                model_bytes = folder_content(folder)
            with outputs.write(written) as temporary:
                temporary.write_bytes(model_bytes)
    if written.absolute() == (folder / ONNX_NAME).absolute():
        write_run(folder, read_run(folder)[0])
    typer.echo(f"{written}: {written.stat().st_size / 1e6:.2f} MB")


def app_main() -> None:
    """Run the command line. A user error ends it with one line instead of a traceback."""
    try:
        run_command(app, "surrogate")
    except ModuleNotFoundError as error:
        if error.name not in ("keras", "tensorflow"):
            raise
        from surrogate.networks import TRAINING_EXTRA

        typer.echo(f"surrogate: {TRAINING_EXTRA}", err=True)
        sys.exit(2)
