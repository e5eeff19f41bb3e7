"""The command `surrogate predict`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bem._support.command_line import FIRST_PROTOCOL, FIRST_TABOR, first_default

if TYPE_CHECKING:
    from surrogate.cli.predict_io import Table
    from surrogate.model import Surrogate

RATIO = "modulus_ratio"
USUAL_MODULUS_RATIO = 0.1
"""Modulus ratio of the published data set, where neither a model nor the user says another."""

ArchitectureOption = Annotated[
    list[Path] | None,
    typer.Option(help="Python file that registers an architecture. May be repeated."),
]
FoundOption = Annotated[
    Path | None, typer.Option(help="Directory of published models. Default: those that `surrogate.load` searches.")
]


def predict(
    name: Annotated[
        str, typer.Argument(help="fast, accurate, name of a published model, folder (./NAME), or ONNX file.")
    ],
    tabor: Annotated[
        float | None, typer.Option(help="Tabor parameter.", show_default=f"{FIRST_TABOR:g}, without --in")
    ] = None,
    peak_indentation: Annotated[
        float | None,
        typer.Option(help="Indentation during the dwell, in h0.", show_default=first_default("peak_indentation")),
    ] = None,
    loading_rate: Annotated[
        float | None,
        typer.Option(help="In h0 per retardation time.", show_default=first_default("loading_rate")),
    ] = None,
    dwell_time: Annotated[
        float | None, typer.Option(help="In retardation times.", show_default=first_default("dwell_time"))
    ] = None,
    unloading_rate: Annotated[
        float | None,
        typer.Option(help="In h0 per retardation time.", show_default=first_default("unloading_rate")),
    ] = None,
    source: Annotated[
        Path | None,
        typer.Option("--in", help="Protocols, .csv or .json; see the user's guide."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="File for the trajectories, .csv or .json. A .csv of protocols from --in has a row of each."),
    ] = None,
    steps: Annotated[
        bool, typer.Option("--steps", help="Also write the protocols of --in to .csv step by step.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print scalars and arrays as JSON.")] = False,
    plot: Annotated[
        Path | None,
        typer.Option(
            help="Image of the force over time and over indentation. On a terminal, a new prediction.png by default."
        ),
    ] = None,
    check: Annotated[bool, typer.Option(help="Also run the solver, and report the errors.")] = False,
    modulus_ratio: Annotated[
        float | None,
        typer.Option(
            help="Modulus ratio of the solid for fast and accurate, 0.1 by default; of the solver in the check of "
            "another model. Default: the model's."
        ),
    ] = None,
    coverage: Annotated[
        float | None,
        typer.Option(help="Share of true values that the bands of fast and accurate contain. Default: 0.9."),
    ] = None,
    backend: Annotated[str, typer.Option(help="Backend, onnx or keras.")] = "onnx",
    models: FoundOption = None,
    architecture: ArchitectureOption = None,
) -> None:
    """Predict the force of one protocol or of many.

    The models fast and accurate take protocols on any standard linear solid, and give bands. Without a protocol, the
    paper's sample protocol (1) is predicted.

    Example: surrogate predict accurate --modulus-ratio 0.3 --tabor 1 --peak-indentation 20 --loading-rate 10
    --dwell-time 1 --unloading-rate 10 --check --plot prediction.png
    """
    import surrogate
    from bem._support.outputs import IMAGES, Outputs, default_picture, require_suffix
    from bem.results.plots import title_of
    from surrogate.architectures.registry import load_architectures
    from surrogate.cli.comparison import plot_predictions, readable
    from surrogate.cli.predict_io import asked, of_protocols, to_json, write_protocols, write_trajectories
    from surrogate.validity import advice

    require_suffix(out, (".csv", ".json"))
    require_suffix(plot, IMAGES)
    if source is not None and out is not None and source.absolute() == out.absolute():
        raise ValueError(f"--out must be another file than --in, which stays as it is; received {out} for both")
    protocol: tuple[float | None, ...] = peak_indentation, loading_rate, dwell_time, unloading_rate
    if source is None:
        tabor = FIRST_TABOR if tabor is None else tabor
        protocol = tuple(FIRST_PROTOCOL.values()) if protocol == (None,) * 4 else protocol
    table = asked(source, (tabor, *protocol))
    plot = plot or default_picture("prediction", as_json, out)
    load_architectures(architecture or ())
    with Outputs(out, plot) as outputs:
        model = surrogate.load(name, models, backend=backend)
        if coverage is not None and model.bands is None:
            raise ValueError(f"--coverage must go with fast or accurate, which have bands; received {model.name}")
        ratio = _solver_material(model, table, modulus_ratio, check=check)
        answers = of_protocols(model, table, ratio, coverage)
        refused = [
            (number, answer.predicted.status) for number, answer in enumerate(answers) if not answer.predicted.completed
        ]
        if refused and len(answers) == 1:
            typer.echo(f"surrogate: {refused[0][1]}", err=True)
            raise typer.Exit(1)
        for number, status in refused[:1]:
            typer.echo(f"warning: {len(refused)} of {len(answers)} trajectories are NaN; {number}: {status}", err=True)
        quiet = out is not None and len(answers) > 1
        warned = [(number, answer.predicted) for number, answer in enumerate(answers) if answer.predicted.completed]
        outside = [(number, text) for number, trajectory in warned for text in trajectory.extrapolated]
        beyond = len({number for number, _ in outside})
        for number, text in outside[:1] if quiet else outside:
            more = f"{beyond} of {len(answers)} trajectories extrapolate; " if quiet else ""
            typer.echo(f"warning: {more}trajectory {number} extrapolates: {text}; {advice([text])}", err=True)

        for answer in answers if check else ():
            answer.compare(model.modulus_ratio)
        if out is not None:
            with outputs.write(out) as temporary:
                if source is None or steps or out.suffix == ".json":
                    write_trajectories(temporary, answers)
                else:
                    write_protocols(temporary, table.columns, answers)
        alone = len(answers) == 1 and model.modulus_ratio in (None, ratio)
        title = title_of(answers[0].scene, answers[0].protocol) if alone else ""
        if plot is not None:
            with outputs.write(plot) as temporary:
                simulated = [answer.simulated for answer in answers] if check else None
                plot_predictions(temporary, [answer.predicted for answer in answers], simulated, title)
    if as_json:
        typer.echo(to_json(answers))
    elif quiet:
        typer.echo(f"{len(answers) - len(refused)} trajectories are predicted")
    for number, answer in enumerate(() if as_json or quiet else answers):
        typer.echo(f"{title or f'trajectory {number}'}\n")
        typer.echo(readable(number, answer.predicted, answer.check))
    if outputs.sentence:
        typer.echo(outputs.sentence, err=as_json)
    if refused:
        raise typer.Exit(1)


def _solver_material(model: Surrogate, table: Table, chosen: float | None, *, check: bool) -> float:
    """Return the modulus ratio for the solver, after a warning if it is not known to be that of the training set.

    Raises:
        ValueError: a column of modulus ratios for a model of one material or beside `--modulus-ratio`, or another
            modulus ratio than the model's without a check.
    """
    column = RATIO in table.columns
    if column and model.bands is None:
        raise ValueError(
            f"protocols must have no {RATIO} for {model.name}, which knows one material; accurate and fast know any "
            f"standard linear solid; received a column {RATIO} in {table.path}"
        )
    if column and chosen is not None:
        raise ValueError(
            f"modulus ratios must come from --in FILE or from --modulus-ratio, not both; received {chosen!r} "
            f"and a column {RATIO} in {table.path}"
        )
    own = model.modulus_ratio
    if chosen is None:
        if check and own is None and model.bands is None:
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
