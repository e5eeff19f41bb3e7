"""The commands `bem campaign`, `bem merge` and `bem verify`: they read the options and print the outcome."""

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer

from bem._support.command_line import one_sentence, parse_accuracy
from bem._support.outputs import require_output
from bem._support.wording import shown

INTERRUPTED = 130
DESIGN_HELP = "How protocols are drawn: paper (the default), log-uniform or sobol."
RATIO_HELP = "Modulus ratio E0/Einf; 0.1 by default. LOW:HIGH draws it, by log-uniform or sobol."
STEPS_HELP = "Where forces are stored: uniform steps as in the paper (the default), or physical ones."
RANGE_HELP = "NAME=LOW:HIGH or NAME=VALUE for a quantity of the design; may be repeated."
CLUSTER_HELP = "Use the workers of this Dask scheduler, e.g. tcp://127.0.0.1:8786, instead of this machine's cores."


@one_sentence("bem")
def campaign(
    out: Annotated[Path | None, typer.Option(help="The data set file to write.")] = None,
    design: Annotated[str | None, typer.Option(help=DESIGN_HELP)] = None,
    count: Annotated[int | None, typer.Option(help="How many protocols; 12450 by default, as in the paper.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the design; 0 by default.")] = None,
    accuracy: Annotated[str | None, typer.Option(help="As in `bem simulate`; standard by default.")] = None,
    modulus_ratio: Annotated[str | None, typer.Option(help=RATIO_HELP)] = None,
    ranges: Annotated[list[str] | None, typer.Option("--range", help=RANGE_HELP)] = None,
    design_file: Annotated[
        Path | None, typer.Option(help="TOML file of design, count, seed, accuracy, modulus_ratio and a table ranges.")
    ] = None,
    steps: Annotated[str | None, typer.Option(help=STEPS_HELP)] = None,
    native: Annotated[bool, typer.Option(help="Keep the solver's own, adaptive histories too.")] = False,
    workers: Annotated[int | None, typer.Option(help="Processes; as many as cores by default.")] = None,
    cluster: Annotated[str | None, typer.Option(help=CLUSTER_HELP)] = None,
    shard: Annotated[str | None, typer.Option(help="i/n: only the i-th of n shares, for job arrays.")] = None,
    replace: Annotated[bool, typer.Option(help="Replace the file of another campaign, once complete.")] = False,
    retry_failed: Annotated[bool, typer.Option(help="Compute what failed in an earlier run again.")] = False,
    verify: Annotated[Path | None, typer.Option(hidden=True)] = None,
    sample: Annotated[int | None, typer.Option(hidden=True)] = None,
) -> None:
    """Simulate many protocols into a data set file; after an interruption the same command continues.

    The exit status is 1 when any trajectory failed.
    """
    if verify is not None or sample is not None:
        raise ValueError("a data set is verified by `bem verify FILE --sample N`; received --verify or --sample")
    if out is None:
        raise ValueError("campaign needs --out FILE.h5 to write")
    from bem.dataset.designs import parse_ratio
    from bem.dataset.measurement_steps import PHYSICAL

    given = {
        "design": design,
        "count": count,
        "seed": seed,
        "accuracy": None if accuracy is None else parse_accuracy(accuracy),
        "modulus_ratio": None if modulus_ratio is None else parse_ratio(modulus_ratio),
        "steps": steps,
        "counts": PHYSICAL if steps == "physical" else None,
    }
    how = {"workers": workers, "cluster": cluster, "replace": replace, "retry_failed": retry_failed}
    with _workers_loading(workers, out) if cluster is None else nullcontext():
        settings = _settings(design_file)
        settings |= {name: value for name, value in given.items() if value is not None}
        settings["ranges"] = {**settings.get("ranges", {}), **_ranges(ranges or [])}
        _run(settings, out, native=native, shard=_shard(shard), how=how)


@one_sentence("bem")
def merge(
    shards: Annotated[list[Path], typer.Argument(help="The data set files of all shards.")],
    out: Annotated[Path, typer.Option(help="The data set file to write.")],
    replace: Annotated[bool, typer.Option(help="Replace the file of another campaign.")] = False,
) -> None:
    """Join the data set files that `bem campaign --shard` wrote."""
    from bem.dataset.campaign.files import merge as join

    _require_place(out)
    summary = join(shards, out, command=_command(), replace=replace)
    failed = sum(summary.failures.values())
    typer.echo(f"{summary.count} trajectories of {len(shards)} shards in {summary.path}, {failed} failed")
    _end_with_failures(summary)


@one_sentence("bem")
def verify(
    file: Annotated[Path, typer.Argument(help="The data set file.")],
    sample: Annotated[int, typer.Option(help="How many trajectories, drawn at random, to compute again.")] = 20,
    workers: Annotated[int | None, typer.Option(help="Processes; as many as cores by default.")] = None,
) -> None:
    """Compute a sample of a data set again and compare, on any processor.

    Pull-off force, hysteresis and force history may differ by twice the accuracy the file was made with, as either
    may err by that; the number of trajectories that are identical to the last bit is printed too. The exit status is 1
    when any does not agree.
    """
    from bem._support.progress import progress_bar
    from bem.dataset.verification import verify as compare

    with progress_bar(sample, "differ") as progress:
        found = compare(file, sample=sample, workers=workers, progress=progress)
    typer.echo(str(found))
    if not found.agrees:
        raise typer.Exit(1)


def register(app: typer.Typer) -> None:
    """Add the commands to the command line `bem`."""
    app.command()(campaign)
    app.command()(merge)
    app.command()(verify)


@contextmanager
def _workers_loading(workers: int | None, out: Path) -> Iterator[None]:
    """Let workers load the solver while this process gets ready, unless there is a file, which may be complete."""
    if out.exists():
        yield
        return
    from bem.dataset.campaign.executors import LocalExecutor

    with LocalExecutor(workers) as local:
        local.load_solver()
        from bem._numerics.jit import announce_compilation

        announce_compilation()
        yield


def _settings(design_file: Path | None) -> dict[str, Any]:
    from bem.dataset.designs import read_design_file

    return read_design_file(design_file) if design_file else {}


def _run(
    settings: dict[str, Any],
    out: Path,
    *,
    native: bool,
    shard: tuple[int, int],
    how: dict[str, Any],
) -> None:
    from bem._support.progress import progress_bar
    from bem.dataset.campaign.plan import Campaign
    from bem.dataset.campaign.run import run_campaign
    from bem.dataset.designs import Design

    design = Design(settings.pop("design", "paper"), settings.pop("ranges"), settings.pop("modulus_ratio", 0.1))
    plan = Campaign(design=design, native=native, shard=shard, **settings)
    _require_place(out)
    # A terminated job then saves what it holds, as an interrupted one does.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with progress_bar(len(plan.indices)) as progress:
            summary = run_campaign(plan, out, command=_command(), progress=progress, **how)
    except KeyboardInterrupt:
        typer.echo("bem: interrupted; what was done is saved, and the same command continues", err=True)
        raise typer.Exit(INTERRUPTED) from None
    if summary.damaged:
        typer.echo(f"{summary.damaged} damaged parts of an earlier run were computed again")
    failed = sum(summary.failures.values())
    typer.echo(
        f"{summary.count} trajectories in {summary.path}, {summary.computed} of them computed now, {failed} failed; "
        f"{summary.wall_seconds:.1f} s in all, {summary.core_seconds / 60.0:.2f} core-minutes"
    )
    _end_with_failures(summary)


def _end_with_failures(summary: Any) -> None:
    for reason, times in summary.failures.most_common():
        typer.echo(f"{times} failed: {reason}")
    if summary.failures:
        raise typer.Exit(1)


def _require_place(out: Path) -> None:
    """Refuse a file that cannot be written before hours are spent; a campaign makes directories still missing."""
    from bem.dataset.campaign.run import followed

    if out.absolute().parent.is_dir() and not out.is_dir():
        require_output(followed(out))


def _command() -> str:
    from bem._support.provenance import command_line

    return command_line(sys.argv)


def _ranges(texts: list[str]) -> dict[str, tuple[float, float]]:
    from bem.dataset.designs import parse_range

    found: dict[str, tuple[float, float]] = {}
    for name, bounds in map(parse_range, texts):
        if name in found:
            raise ValueError(f"range must name a quantity once; received {shown(name)} twice")
        found[name] = bounds
    return found


def _shard(text: str | None) -> tuple[int, int]:
    if text is None:
        return 1, 1
    number, _, total = text.partition("/")
    try:
        return int(number), int(total)
    except ValueError:
        raise ValueError(f"shard must read i/n, e.g. 3/8; received {shown(text)}") from None
