"""The command line `surrogate`: list, train, train-all, evaluate, predict, export."""

from __future__ import annotations

import importlib.util
import json
import shlex
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from bem.command import add_version, run_command
from bem.outputs import Outputs
from surrogate.architectures.naming import PAPER_PARAMETER_COUNTS, names, split_name
from surrogate.backend import import_keras, limit_threads
from surrogate.model_files import find_model, model_roots
from surrogate.predict_cli import register
from surrogate.queue import STOP_FILE, STOPPED, StopRequest, outdated, run_queue, set_aside

app = typer.Typer(
    help="Sequence models that imitate the contact solver.", no_args_is_help=True, pretty_exceptions_enable=False
)

add_version(app, "surrogate")

DatasetOption = Annotated[Path, typer.Option(help="Data set file.")]
RecipeOption = Annotated[str, typer.Option(help="A recipe's name (paper, swift) or a TOML file.")]
RunsOption = Annotated[Path, typer.Option(help="Where runs keep checkpoints; a file called STOP there stops them.")]
ModelsOption = Annotated[Path, typer.Option(help="Where finished models are published.")]
FoundOption = Annotated[
    Path | None, typer.Option(help="Where models are published, instead of the places `surrogate.load` looks at.")
]
EpochsOption = Annotated[int | None, typer.Option(help="Epochs, instead of the recipe's.")]
ThreadsOption = Annotated[int | None, typer.Option(help="Threads of the backend; as many as it likes by default.")]
SeedOption = Annotated[int | None, typer.Option(help="Seed of weights and batches, instead of the recipe's.")]

DATASET = Path("published/dataset.h5")
RUNS = Path("results/training")
MODELS = Path("published/models")


@app.command("list")
def list_models(
    models: FoundOption = None,
    markdown: Annotated[bool, typer.Option(help="Print the table of docs/surrogate-models.md.")] = False,
) -> None:
    """List the eighteen models, their parameters, and what is published."""
    from surrogate.tables import parameter_table

    if markdown:
        typer.echo(parameter_table())
        return
    for name in names():
        whose = "paper" if name in PAPER_PARAMETER_COUNTS else "ours"
        places = [root / name / "metrics.json" for root in model_roots(models)]
        metrics = next((_metrics(place) for place in places if place.is_file()), {})
        error = f"test MSE {metrics['test']['mse']['mean']:.2e}" if metrics else ""
        typer.echo(f"{name:<10} {_parameters(name, metrics):>8} parameters ({whose})  {error}".rstrip())


@app.command()
def train(
    name: Annotated[str, typer.Argument(help="One of the eighteen, see `surrogate list`.")],
    recipe: RecipeOption = "swift",
    dataset: DatasetOption = DATASET,
    features: Annotated[str, typer.Option(help="Feature set A to D.")] = "D",
    epochs: EpochsOption = None,
    seed: SeedOption = None,
    split_seed: Annotated[int, typer.Option(help="Seed of the division into training, validation, test.")] = 0,
    fraction: Annotated[float, typer.Option(help="Share of the training part to use.")] = 1.0,
    fold: Annotated[int, typer.Option(help="Which nested family of such shares.")] = 0,
    extra: Annotated[Path | None, typer.Option(help="A second data set, all for training.")] = None,
    label: Annotated[str | None, typer.Option(help="Publish under this name.")] = None,
    replace: Annotated[bool, typer.Option(help="Replace a published model that was trained otherwise.")] = False,
    threads: ThreadsOption = None,
    runs: RunsOption = RUNS,
    models: ModelsOption = MODELS,
) -> None:
    """Train one model, or resume its training, and publish it when it is finished."""
    split_name(name)
    given = {"features": features != "D", "split-seed": split_seed, "fraction": fraction != 1.0, "extra": extra}
    otherwise = [f"--{option}" for option, chosen in given.items() if chosen]
    if otherwise and not label and models == MODELS:
        raise ValueError(
            f"Expected --label beside {', '.join(otherwise)}, since {models / name} is for the model trained like all "
            f"others. Received: label={label!r}"
        )
    from surrogate.recipe import Recipe

    chosen = Recipe.load(recipe).with_overrides(epochs=epochs, seed=seed)
    if threads is not None:
        limit_threads(threads)
    import_keras()
    from surrogate.dataset import TrajectoryDataset
    from surrogate.progress import reporter
    from surrogate.runs import Run, execute, publish

    data = TrajectoryDataset.load(dataset)
    run = Run(
        architecture=name,
        dataset=data,
        split=data.split(split_seed).with_fraction(fraction, fold),
        recipe=chosen,
        features=features,
        extra=TrajectoryDataset.load(extra) if extra else None,
        label=label or "",
    )
    asked = {"dataset_sha256": data.sha256, "recipe": chosen, "split": run.split, "features": features}
    if not (label or replace) and (models / name / "run.json").exists():
        if why := outdated(models / name, **asked):
            raise ValueError(
                f"Expected --label for a name of its own, or --replace, since {models / name} is already published. "
                f"Received: neither, and there one {why}"
            )
        typer.echo(f"{name}: already published in {models / name}; --replace trains it again")
        return
    with reporter(run.name) as report:
        progress = execute(
            run,
            runs / run.name,
            should_stop=StopRequest(runs),
            report=report,
            log=typer.echo,
            command=shlex.join(["surrogate", *sys.argv[1:]]),
        )
    if not progress.finished:
        typer.echo(f"{run.name}: stopped after epoch {progress.epoch}; the same command resumes it")
        raise typer.Exit(STOPPED)
    publish(runs / run.name, models / run.name)
    typer.echo(f"{run.name}: published in {models / run.name}")


@app.command("train-all")
def train_all(
    recipe: RecipeOption = "swift",
    dataset: DatasetOption = DATASET,
    only: Annotated[list[str] | None, typer.Option(help="Train this model; may be repeated.")] = None,
    epochs: EpochsOption = None,
    seed: SeedOption = None,
    jobs: Annotated[int, typer.Option(min=1, help="Models at a time.")] = 2,
    threads: Annotated[int, typer.Option(help="Threads of each.")] = 1,
    runs: RunsOption = RUNS,
    models: ModelsOption = MODELS,
) -> None:
    """Train every model that is not published yet, or was trained otherwise; start it again to resume."""
    wanted = list(dict.fromkeys(only)) if only else names()
    for name in wanted:
        split_name(name)
    from surrogate.dataset import TrajectoryDataset
    from surrogate.recipe import Recipe

    data = TrajectoryDataset.load(dataset)
    asked = {
        "dataset_sha256": data.sha256,
        "recipe": Recipe.load(recipe).with_overrides(epochs=epochs, seed=seed),
        "split": data.split(),
    }
    waiting = []
    for name in wanted:
        reason = outdated(models / name, **asked) if (models / name / "run.json").exists() else "not published"
        if not reason:
            continue
        if reason != "not published":
            typer.echo(f"{name}: outdated, {reason}; it is trained again")
        if (aside := set_aside(runs / name, **asked)) is not None:
            typer.echo(f"{name}: the work of another training is kept in {aside}")
        waiting.append(name)

    def command(name: str) -> list[str]:
        options = {
            "recipe": recipe,
            "dataset": dataset,
            "epochs": epochs,
            "seed": seed,
            "threads": threads,
            "runs": runs,
            "models": models,
        }
        flags = [[f"--{option}", str(value)] for option, value in options.items() if value is not None]
        return ["train", name, "--replace", *(word for flag in flags for word in flag)]

    typer.echo(f"{len(waiting)} of {len(wanted)} models to train, {jobs} at a time")
    ended = run_queue(waiting, command, folder=runs, jobs=jobs, log=typer.echo)
    if any(status not in (0, STOPPED) for status in ended.values()):
        raise typer.Exit(1)
    if len(ended) < len(waiting) or STOPPED in ended.values():
        file = runs / STOP_FILE
        typer.echo(f"Stopped; the same command resumes{f', once {file} is removed' if file.exists() else ''}")
        raise typer.Exit(STOPPED)


@app.command()
def evaluate(
    name: Annotated[str, typer.Argument(help="A published model, or the path of a model directory.")],
    dataset: DatasetOption = DATASET,
    models: FoundOption = None,
    errors: Annotated[Path | None, typer.Option(help="Write every trajectory's errors to this CSV file.")] = None,
    threads: ThreadsOption = None,
) -> None:
    """Measure a trained model on its own test trajectories."""
    if threads is not None:
        limit_threads(threads)
    import_keras()
    from surrogate.evaluation import evaluate_published, write_errors
    from surrogate.metrics import summary
    from surrogate.predictor import Surrogate

    with Outputs(errors) as outputs:
        trained = Surrogate.load(name, root=models, backend="keras")
        indices, found = evaluate_published(trained, find_model(name, models), dataset)
        if errors is not None:
            with outputs.write(errors) as part:
                write_errors(part, indices, found)
    for quantity, values in summary(found).items():
        numbers = "  ".join(f"{statistic} {value:.3e}" for statistic, value in values.items())
        typer.echo(f"{quantity:<30} {numbers}")


register(app)


def _metrics(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        _ = float(content["test"]["mse"]["mean"]), int(content["parameters"])
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"Expected a metrics.json that `surrogate train` wrote. Received: {path}") from error
    return content


def _parameters(name: str, metrics: dict[str, Any]) -> str:
    """Trainable parameters in words; counting those of an untrained model needs Keras."""
    known = metrics.get("parameters") or PAPER_PARAMETER_COUNTS.get(name)
    if known is None and importlib.util.find_spec("keras") is not None:
        import surrogate

        known = surrogate.build(name).count_params()
    return "?" if known is None else f"{known:,}"


def app_main() -> None:
    """Run the command line; a user's mistake ends it with one line instead of a traceback."""
    try:
        run_command(app, "surrogate")
    except ModuleNotFoundError as error:
        if error.name not in ("keras", "tensorflow", "sklearn"):
            raise
        from surrogate.backends import TRAINING_EXTRA

        typer.echo(f"surrogate: {TRAINING_EXTRA}", err=True)
        sys.exit(2)
