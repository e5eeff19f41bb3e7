"""The commands `bem campaign`, `bem merge` and `bem verify`: they read the options and print the outcome."""

import signal
import sys
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from bem._support.command_line import one_sentence, parse_accuracy, progress_bar
from bem._support.interruption import end, say_what_is_kept
from bem._support.provenance import command_line
from bem.cli.arguments import File, Text, option, parse_ranges, parse_ratio, parse_shard, parse_solids, read_design_file

DESIGN_HELP = "How protocols are drawn; as in the paper by default."
RATIO_HELP = "Modulus ratio E0/Einf; 0.1 by default. LOW:HIGH draws it, by any design but paper."
SOLIDS_HELP = (
    "Random linear solids: prony, broad or power-law, with :LOW-HIGH for other numbers of terms; or an entry of the "
    "materials library or a .toml file, in units of its mean retardation time. Standard linear solids by default."
)
STEPS_HELP = (
    "Where forces are stored: uniform steps as in the paper (the default), or steps around the pull-off that is found."
)
RANGE_HELP = "NAME=LOW:HIGH or NAME=VALUE for a quantity of the design; may be repeated."
CLUSTER_HELP = "Use the workers of this Dask scheduler, e.g. tcp://127.0.0.1:8786, instead of this machine's cores."


@one_sentence("bem")
def campaign(
    out: Annotated[Path, option("The data set file to write.")],
    design: Annotated[Literal["paper", "log-uniform", "sobol", "edges", "corners"] | None, option(DESIGN_HELP)] = None,
    count: Annotated[int | None, option("How many protocols; 12450 by default, as in the paper.")] = None,
    seed: Annotated[int | None, option("Seed of the design; 0 by default.")] = None,
    accuracy: Annotated[Text, option("As in `bem simulate`; standard by default.")] = None,
    modulus_ratio: Annotated[Text, option(RATIO_HELP)] = None,
    ranges: Annotated[list[str] | None, option(RANGE_HELP, "--range")] = None,
    design_file: Annotated[
        File, option("TOML file of design, count, seed, accuracy, modulus_ratio and a table ranges.")
    ] = None,
    solids: Annotated[Text, option(SOLIDS_HELP)] = None,
    steps: Annotated[Literal["uniform", "pull-off"] | None, option(STEPS_HELP)] = None,
    native: Annotated[bool, option("Keep the solver's own, adaptive histories too.")] = False,
    workers: Annotated[int | None, option("Processes; as many as cores by default.")] = None,
    cluster: Annotated[Text, option(CLUSTER_HELP)] = None,
    shard: Annotated[Text, option("i/n: only the i-th of n shares, for job arrays.")] = None,
    replace: Annotated[bool, option("Replace the file of another campaign, once complete.")] = False,
    retry_failed: Annotated[bool, option("Compute what failed in an earlier run again.")] = False,
) -> None:
    """Simulate many protocols into a data set file; after an interruption the same command continues.

    The exit status is 1 when any trajectory failed.
    """
    from bem.dataset.campaign import Campaign
    from bem.dataset.designs import Design
    from bem.dataset.measurement_steps import PULL_OFF
    from bem.dataset.run import run_campaign
    from bem.simulation import load_kernels

    options = {
        "design": design,
        "count": count,
        "seed": seed,
        "accuracy": None if accuracy is None else parse_accuracy(accuracy),
        "modulus_ratio": None if modulus_ratio is None else parse_ratio(modulus_ratio),
        "steps": steps,
        "counts": PULL_OFF if steps == "pull-off" else None,
    }
    settings = read_design_file(design_file) if design_file else {}
    settings |= {name: value for name, value in options.items() if value is not None}
    bounds = settings.pop("ranges", {}) | parse_ranges(ranges or [])
    spectra, ratio = (None, 0.1) if solids is None else parse_solids(solids)
    drawn = Design(settings.pop("design", "paper"), bounds, settings.pop("modulus_ratio", ratio), spectra)
    plan = Campaign(design=drawn, native=native, shard=parse_shard(shard), **settings)
    if cluster is None and not out.exists():
        load_kernels("boundary elements")  # before the workers would, each for itself
    say_what_is_kept("what was done is saved, and the same command continues")
    signal.signal(signal.SIGTERM, lambda *_: end("bem"))  # a batch system ends a job so
    how = {"workers": workers, "cluster": cluster, "replace": replace, "retry_failed": retry_failed}
    with progress_bar(len(plan.indices)) as progress:
        summary = run_campaign(plan, out, command=command_line(sys.argv), progress=progress, **how)
    if summary.damaged:
        typer.echo(f"{summary.damaged} damaged parts of an earlier run were computed again")
    failed = sum(summary.failures.values())
    typer.echo(
        f"{summary.count} trajectories in {summary.path}, {summary.computed} of them computed now, {failed} failed; "
        f"{summary.wall_seconds:.1f} s in all, {summary.core_seconds / 60.0:.2f} core-minutes"
    )
    _end_with_failures(summary)


@one_sentence("bem")
def merge(
    shards: Annotated[list[Path], typer.Argument(help="The data set files of all shards.")],
    out: Annotated[Path, option("The data set file to write.")],
    replace: Annotated[bool, option("Replace the file of another campaign.")] = False,
) -> None:
    """Join the data set files that `bem campaign --shard` wrote."""
    from bem.dataset.run import merge as join

    summary = join(shards, out, command=command_line(sys.argv), replace=replace)
    failed = sum(summary.failures.values())
    typer.echo(f"{summary.count} trajectories of {len(shards)} shards in {summary.path}, {failed} failed")
    _end_with_failures(summary)


@one_sentence("bem")
def verify(
    file: Annotated[Path, typer.Argument(help="The data set file.")],
    sample: Annotated[int, option("How many trajectories, drawn at random, to compute again.")] = 20,
    workers: Annotated[int | None, option("Processes; as many as cores by default.")] = None,
) -> None:
    """Compute a sample of a data set again and compare, on any processor.

    Pull-off force, hysteresis and force history may differ by twice the accuracy the file was made with, as either
    may err by that; the number of trajectories that are identical to the last bit is printed too. The exit status is 1
    when any does not agree.
    """
    from bem.dataset.verification import verify as compare

    with progress_bar(sample, "differ") as progress:
        verification = compare(file, sample=sample, workers=workers, progress=progress)
    typer.echo(str(verification))
    if not verification.agrees:
        raise typer.Exit(1)


def _end_with_failures(summary: Any) -> None:
    for reason, times in summary.failures.most_common():
        typer.echo(f"{times} failed: {reason}")
    if summary.failures:
        raise typer.Exit(1)
