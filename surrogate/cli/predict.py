"""The command `surrogate predict`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from surrogate.cli.answer import USUAL_MODULUS_RATIO, Answer, asked_protocols, readable
from surrogate.cli.solids import predict_solids, require_one_material

ArchitectureOption = Annotated[
    list[Path] | None,
    typer.Option(help="Python file that registers an architecture. May be repeated."),
]
FoundOption = Annotated[
    Path | None, typer.Option(help="Directory of published models. Default: those that `surrogate.load` searches.")
]


def predict(
    name: Annotated[
        str, typer.Argument(help="fast, accurate, name of a published model, model directory, or ONNX file.")
    ],
    tabor: Annotated[float | None, typer.Option(help="Tabor parameter.")] = None,
    peak_indentation: Annotated[float | None, typer.Option(help="Indentation during the dwell.")] = None,
    loading_rate: Annotated[float | None, typer.Option(help="Rate of indentation in loading.")] = None,
    dwell_time: Annotated[float | None, typer.Option(help="Duration of the dwell.")] = None,
    unloading_rate: Annotated[float | None, typer.Option(help="Rate of indentation in unloading.")] = None,
    source: Annotated[
        Path | None,
        typer.Option("--in", help="Protocols or one history, .csv or .json; see the user's guide."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="File for the trajectories, .csv or .json.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print scalars and arrays as JSON.")] = False,
    plot: Annotated[Path | None, typer.Option(help="Image of the force over time and over indentation.")] = None,
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
    """Predict the force of one protocol, of many protocols, or along an indentation history.

    The models fast and accurate take protocols on any standard linear solid, and give bands.

    Example: surrogate predict accurate --modulus-ratio 0.3 --tabor 1 --peak-indentation 20 --loading-rate 10
    --dwell-time 1 --unloading-rate 10 --check --plot prediction.png
    """
    import surrogate
    from bem._support.outputs import IMAGES, Outputs, require_suffix
    from bem.dataset.designs import QUANTITIES
    from surrogate.architectures.registry import load_architectures
    from surrogate.cli.comparison import plot_predictions, simulate_same, solver_force
    from surrogate.cli.predict_io import read_table, to_json, write_trajectories
    from surrogate.inference.validity import advice
    from surrogate.pretrained.model import Pretrained

    require_suffix(out, (".csv", ".json"))
    require_suffix(plot, IMAGES)
    given = (tabor, peak_indentation, loading_rate, dwell_time, unloading_rate)
    options = dict(zip(QUANTITIES, given, strict=True))
    table = read_table(source) if source is not None else None
    load_architectures(architecture or ())
    with Outputs(out, plot) as outputs:
        model = surrogate.load(name, models, backend=backend)
        if isinstance(model, Pretrained):
            asked = predict_solids(model, table, options, modulus_ratio, coverage)
        else:
            require_one_material(model.name, table, coverage)
            ratio = _solver_material(model, modulus_ratio, check=check)
            asked = _predict_one_material(model, table, options, ratio, check=check)
        for number, trajectory in enumerate(asked.found):
            for words in trajectory.extrapolated:
                typer.echo(f"warning: trajectory {number} extrapolates: {words}; {advice([words])}", err=True)

        simulated = simulate_same(asked.protocols, asked.tabor, asked.solver_ratios) if check else None
        checks = forces = None
        if simulated is not None:
            checks = asked.compared(simulated)
            forces = [solver_force(*pair) for pair in zip(asked.at_points, simulated, strict=True)]
        if out is not None:
            with outputs.write(out) as part:
                write_trajectories(part, asked.written, checks, forces)
        if plot is not None:
            with outputs.write(plot) as part:
                plot_predictions(part, asked.found, simulated)
    if as_json:
        typer.echo(to_json(asked.written, checks, forces))
        return
    for number, trajectory in enumerate(asked.found):
        typer.echo(readable(number, trajectory, checks[number] if checks else None))
        if fitted := getattr(asked.written[number], "fitted", None):
            points = len(asked.written[number].time)
            typer.echo(f"  predicted on the protocol fitted to the {points} points: {fitted.words()}")


def _predict_one_material(
    model: Any, table: Any, options: dict[str, float | None], ratio: float, *, check: bool
) -> Answer:
    """Predict with a model of one material; `ratio` is the solver's in the check."""
    from surrogate.inference.histories import predict_history

    if table is None or not table.is_history:
        protocols, tabor = asked_protocols(table, options)
        found = model.trajectories(protocols, tabor=tabor)
        return Answer(protocols, tabor, found, found, found, [ratio] * len(found), [model.modulus_ratio] * len(found))
    mu = _tabor(table, options)
    columns = [table.columns.get(key) for key in ("time", "indentation", "edge")]
    along = predict_history(model, *columns[:2], edge=columns[2], tabor=mu)
    if along.unlike:
        typer.echo(
            f"warning: {table.path} is not a history like those {model.name} was trained on. It is predicted "
            f"at its own points. {along.unlike}. Cut the record to one cycle, or mark both ends of the dwell "
            "in a column edge, and compare with the solver (--check)",
            err=True,
        )
    protocols = [along.protocol] if check else []
    return Answer(protocols, [mu], [along.trajectory], [along], [along.at_points()], [ratio], [model.modulus_ratio])


def _tabor(table: Any, options: dict[str, float | None]) -> float:
    """Return the Tabor parameter of a history, from the file or from `--tabor`."""
    given = options["tabor"]
    unwanted = [key for key, value in options.items() if key != "tabor" and value is not None]
    if unwanted:
        raise ValueError(f"Expected --tabor, and no protocol, with a history. Received: {', '.join(unwanted)}")
    if given is None and table.tabor is None:
        raise ValueError("Expected --tabor, or a column tabor, with a history. Received: neither")
    if given is not None and table.tabor not in (None, given):
        raise ValueError(f"Expected the file's Tabor parameter {table.tabor!r}. Received: --tabor {given!r}")
    return table.tabor if given is None else given


def _solver_material(model: Any, asked: float | None, *, check: bool) -> float:
    """Return the modulus ratio for the solver, after a warning if it is not known to be that of the training set."""
    known = model.modulus_ratio
    if asked is None:
        if check and known is None:
            typer.echo(
                f"warning: {model.name} does not record the modulus ratio it was trained on; the solver uses "
                f"{USUAL_MODULUS_RATIO:g}. --modulus-ratio sets another one",
                err=True,
            )
        return USUAL_MODULUS_RATIO if known is None else known
    if known is None or asked == known:
        return asked
    if not check:
        raise ValueError(
            f"Expected the modulus ratio {known:g} that {model.name} was trained on, or --check to run the solver with "
            f"another one. Received: --modulus-ratio {asked:g}"
        )
    typer.echo(
        f"warning: {model.name} was trained on the modulus ratio {known:g} only; the solver uses {asked:g}, so the "
        "check compares two materials",
        err=True,
    )
    return asked
