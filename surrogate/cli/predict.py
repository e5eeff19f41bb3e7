"""The command `surrogate predict`."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from bem._support.command_line import FIRST_TABOR, first_default

if TYPE_CHECKING:
    from surrogate.cli.comparison import Answer
    from surrogate.cli.predict_io import Table
    from surrogate.model import Surrogate
    from surrogate.solids import SolidSurrogate

RATIO = "modulus_ratio"
USUAL_MODULUS_RATIO = 0.1
"""Modulus ratio of the published data set, where neither a model nor the user says another."""

_in_protocol, _in_solid, _in_output = (
    partial(typer.Option, rich_help_panel=panel) for panel in ("Protocol", "Solid", "Output")
)
ArchitectureOption = Annotated[
    list[Path] | None,
    typer.Option(help="Python file that registers an architecture. May be repeated."),
]
FoundOption = Annotated[
    Path | None, typer.Option(help="Directory of published models. Default: those that `surrogate.load` searches.")
]
NameArgument = Annotated[
    str, typer.Argument(help="fast, accurate, name of a published model, folder (./NAME), or ONNX file.")
]
TaborOption = Annotated[
    float | None, _in_protocol(help="Tabor parameter mu.", show_default=f"{FIRST_TABOR:g}, without --in")
]
PeakOption = Annotated[
    float | None,
    _in_protocol(help="Indentation during the dwell, in h0.", show_default=first_default("peak_indentation")),
]
LoadingOption = Annotated[
    float | None,
    _in_protocol(help="Speed of approach, in h0 per retardation time.", show_default=first_default("loading_rate")),
]
DwellOption = Annotated[
    float | None, _in_protocol(help="Time at the peak, in retardation times.", show_default=first_default("dwell_time"))
]
UnloadingOption = Annotated[
    float | None,
    _in_protocol(help="Speed of withdrawal, in h0 per retardation time.", show_default=first_default("unloading_rate")),
]
InOption = Annotated[Path | None, _in_protocol("--in", help="Protocols, .csv or .json; see the user's guide.")]
OutOption = Annotated[
    Path | None,
    _in_output(help="File for the trajectories, .csv or .json. A .csv of protocols from --in has a row for each."),
]
StepsOption = Annotated[
    bool,
    _in_output("--steps", help="Write a row for each step to --out .csv, not for each protocol of --in."),
]
JsonOption = Annotated[bool, _in_output("--json", help="Print scalars and arrays as JSON.")]
PlotOption = Annotated[
    Path | None,
    _in_output(
        help="Image of the force over time and over indentation. On a terminal, a new prediction.png by default."
    ),
]
CheckOption = Annotated[bool, typer.Option(help="Also run the solver, and report the errors.")]
RatioOption = Annotated[
    float | None,
    _in_solid(
        help="Modulus ratio of the solid for fast and accurate, 0.1 by default; of the solver in the check of another "
        "model. Default: the model's."
    ),
]
MaterialOption = Annotated[
    str | None,
    _in_solid(
        help="Solid for fast and accurate, as of `bem simulate`: elastic, sls:K, prony:C1@T1,C2@T2,..., an entry of "
        "the materials library, or a .toml file."
    ),
]
CoverageOption = Annotated[
    float | None, typer.Option(help="Share of true values that intervals of fast and accurate contain. Default: 0.9.")
]


def predict(
    name: NameArgument,
    tabor: TaborOption = None,
    peak_indentation: PeakOption = None,
    loading_rate: LoadingOption = None,
    dwell_time: DwellOption = None,
    unloading_rate: UnloadingOption = None,
    source: InOption = None,
    out: OutOption = None,
    steps: StepsOption = False,
    as_json: JsonOption = False,
    plot: PlotOption = None,
    check: CheckOption = False,
    modulus_ratio: RatioOption = None,
    material: MaterialOption = None,
    coverage: CoverageOption = None,
    backend: Annotated[Literal["onnx", "keras"], typer.Option(help="What evaluates the network.")] = "onnx",
    models: FoundOption = None,
    architecture: ArchitectureOption = None,
) -> None:
    """Predict the force of one protocol or of many.

    The models fast and accurate take protocols on any linear solid, and give intervals. Without a protocol, the paper's
    sample protocol (1) is predicted. With --radius, all quantities are in newtons, metres and seconds:
    `surrogate predict-si --help` lists the options.

    Example: surrogate predict accurate --modulus-ratio 0.3 --tabor 1 --peak-indentation 20 --loading-rate 10
    --dwell-time 1 --unloading-rate 10 --check --plot prediction.png
    """
    import surrogate
    from bem._support.outputs import IMAGES, Outputs, default_picture, require_suffix
    from bem.results.plots import title_of
    from surrogate.architectures.registry import load_architectures
    from surrogate.cli.comparison import plot_predictions
    from surrogate.cli.predict_io import of_protocols, protocols_asked, write_answers
    from surrogate.files import PRETRAINED

    require_suffix(out, (".csv", ".json"))
    require_suffix(plot, IMAGES)
    if steps and out is None:
        raise ValueError("--steps must go with --out FILE.csv, which then has a row for each step; received no --out")
    if source is not None and out is not None and source.absolute() == out.absolute():
        raise ValueError(f"--out must be another file than --in, which stays as it is; received {out} for both")
    table = protocols_asked(source, (tabor, peak_indentation, loading_rate, dwell_time, unloading_rate))
    plot = plot or default_picture("prediction", as_json, out)
    load_architectures(architecture or ())
    with Outputs(out, plot) as outputs:
        model = surrogate.load(name, models, backend=backend)
        if coverage is not None and not model.any_solid:
            raise ValueError(f"--coverage must go with {' or '.join(PRETRAINED)}, which know it; received {model.name}")
        own = model.modulus_ratio
        answers = of_protocols(model, table, _solid(model, table, material, modulus_ratio, check=check), coverage)
        quiet = out is not None and len(answers) > 1
        refused = _warn(answers, quiet=quiet)
        for answer in answers if check else ():
            answer.compare(own)
        if out is not None:
            with outputs.write(out) as temporary:
                write_answers(temporary, answers, None if source is None or steps else table.columns)
        alone = len(answers) == 1 and own in (None, answers[0].scene.material.modulus_ratio)
        title = title_of(answers[0].scene, answers[0].protocol) if alone else ""
        if plot is not None:
            with outputs.write(plot) as temporary:
                simulated = [answer.simulated for answer in answers] if check else None
                plot_predictions(temporary, [answer.predicted for answer in answers], simulated, title)
    _print(answers, title, as_json=as_json, quiet=quiet)
    if outputs.sentence:
        typer.echo(outputs.sentence, err=as_json)
    if refused:
        raise typer.Exit(1)


def _warn(answers: Sequence[Answer], *, quiet: bool) -> bool:
    """Warn of predictions outside the training, and return whether some are refused; a single one ends the command."""
    from surrogate.validity import advice

    refused = [(number, answer.predicted) for number, answer in enumerate(answers) if not answer.predicted.completed]
    if refused and len(answers) == 1:
        typer.echo(f"surrogate: {refused[0][1].status}", err=True)
        raise typer.Exit(1)
    for number, trajectory in refused[:1]:
        more = f"{len(refused)} of {len(answers)} trajectories are NaN"
        typer.echo(f"warning: {more}; {number}: {trajectory.status}", err=True)
    completed = [(number, answer.predicted) for number, answer in enumerate(answers) if answer.predicted.completed]
    outside = [(number, text) for number, trajectory in completed for text in trajectory.extrapolated]
    beyond = len({number for number, _ in outside})
    for number, text in outside[:1] if quiet else outside:
        more = f"{beyond} of {len(answers)} trajectories extrapolate; " if quiet else ""
        typer.echo(f"warning: {more}trajectory {number} extrapolates: {text}; {advice([text])}", err=True)
    return bool(refused)


def _print(answers: Sequence[Answer], title: str, *, as_json: bool, quiet: bool) -> None:
    from surrogate.cli.comparison import readable
    from surrogate.cli.predict_io import to_json

    if as_json:
        typer.echo(to_json(answers))
    elif quiet:
        typer.echo(f"{sum(answer.predicted.completed for answer in answers)} trajectories are predicted")
    else:
        for number, answer in enumerate(answers):
            typer.echo(f"{title or f'trajectory {number}'}\n")
            typer.echo(readable(number, answer.predicted, answer.check))


def _solid(
    model: Surrogate | SolidSurrogate, table: Table, material: str | None, chosen: float | None, *, check: bool
) -> Any:
    """The solid of `--material`, or the modulus ratio of the standard linear solid for the solver.

    It warns if that is not known to be the one of the training set.

    Raises:
        ValueError: a solid or a column of modulus ratios for a model of one material, more than one way to name the
            solid, or another modulus ratio than the model's without a check.
    """
    from bem.cli.arguments import parse_material
    from surrogate.files import PRETRAINED

    column, own = RATIO in table.columns, model.modulus_ratio
    if column and not model.any_solid:
        raise ValueError(
            f"protocols must have no {RATIO} for {model.name}, which knows one material; accurate and fast know any "
            f"solid; received a column {RATIO} in {table.path}"
        )
    if column and chosen is not None:
        raise ValueError(
            f"modulus ratios must come from --in FILE or from --modulus-ratio, not both; received {chosen!r} "
            f"and a column {RATIO} in {table.path}"
        )
    if material is not None:
        if not model.any_solid:
            raise ValueError(
                f"--material must go with {' or '.join(PRETRAINED)}, which know any solid; received it for {model.name}"
            )
        if chosen is not None or column:
            raise ValueError("the solid must come from --material or from modulus ratios, not both; received both")
        return parse_material(material)
    if chosen is None:
        if check and own is None and not model.any_solid:
            typer.echo(
                f"warning: {model.name} does not record the modulus ratio it was trained on; the solver uses "
                f"{USUAL_MODULUS_RATIO:g}. --modulus-ratio sets another one",
                err=True,
            )
        return USUAL_MODULUS_RATIO if own is None else own
    if own is None or chosen == own:
        return chosen
    if not check:
        raise ValueError(
            f"--modulus-ratio must be {own:g}, on which {model.name} was trained, or --check must run the solver with "
            f"another one; received {chosen:g}"
        )
    typer.echo(
        f"warning: {model.name} was trained on the modulus ratio {own:g} only; the solver uses {chosen:g}, so the "
        "check compares two materials",
        err=True,
    )
    return chosen
