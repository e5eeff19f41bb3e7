"""The commands `surrogate predict` and `surrogate export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from bem._support.wording import shown

ArchitectureOption = Annotated[
    list[Path] | None,
    typer.Option(help="Python file that registers an architecture. May be repeated."),
]
FoundOption = Annotated[
    Path | None, typer.Option(help="Directory of published models. Default: those that `surrogate.load` searches.")
]

USUAL_MODULUS_RATIO = 0.1
"""Modulus ratio of the published data set, for the check of a model that does not record its own."""


def predict(
    name: Annotated[str, typer.Argument(help="Name of a published model, model directory, or ONNX file.")],
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
        float | None, typer.Option(help="Modulus ratio of the solver in the check. Default: the model's.")
    ] = None,
    backend: Annotated[str, typer.Option(help="Backend, onnx or keras.")] = "onnx",
    models: FoundOption = None,
    architecture: ArchitectureOption = None,
) -> None:
    """Predict the force of one protocol, of many protocols, or along an indentation history.

    Example: surrogate predict M1-concat --tabor 1 --peak-indentation 20 --loading-rate 10 --dwell-time 1
    --unloading-rate 10 --check --plot prediction.png
    """
    from bem._support.outputs import IMAGES, Outputs, require_suffix
    from bem.dataset.designs import QUANTITIES
    from surrogate.architectures.registry import load_architectures
    from surrogate.cli.comparison import plot_predictions, simulate_same, solver_errors, solver_force
    from surrogate.cli.predict_io import read_table, to_json, write_trajectories
    from surrogate.inference.histories import predict_history
    from surrogate.inference.predictor import Surrogate
    from surrogate.inference.validity import advice

    require_suffix(out, (".csv", ".json"))
    require_suffix(plot, IMAGES)
    given = (tabor, peak_indentation, loading_rate, dwell_time, unloading_rate)
    options = dict(zip(QUANTITIES, given, strict=True))
    table = read_table(source) if source is not None else None
    load_architectures(architecture or ())
    with Outputs(out, plot) as outputs:
        model = Surrogate.load(name, root=models, backend=backend)
        ratio = _solver_material(model, modulus_ratio, check=check)
        if table is not None and table.is_history:
            mus = [_tabor(table, options)]
            columns = [table.columns.get(key) for key in ("time", "indentation", "edge")]
            along = predict_history(model, *columns[:2], edge=columns[2], tabor=mus[0])
            if along.unlike:
                typer.echo(
                    f"warning: {table.path} is not a history like those {model.name} was trained on. It is predicted "
                    f"at its own points. {along.unlike}. Cut the record to one cycle, or mark both ends of the dwell "
                    "in a column edge, and compare with the solver (--check)",
                    err=True,
                )
            found, written, at_points = [along.trajectory], [along], [along.at_points()]
            protocols = [along.protocol] if check else []
        else:
            protocols, mus = _protocols(table, options)
            found = written = at_points = model.trajectories(protocols, tabor=mus)
        for number, trajectory in enumerate(found):
            for words in trajectory.extrapolated:
                typer.echo(f"warning: trajectory {number} extrapolates: {words}; {advice([words])}", err=True)

        simulated = simulate_same(protocols, mus, ratio) if check else None
        checks = forces = None
        if simulated is not None:
            materials = {"modulus_ratio": ratio, "model_modulus_ratio": model.modulus_ratio}
            checks = [solver_errors(*pair) | materials for pair in zip(found, simulated, strict=True)]
            forces = [solver_force(*pair) for pair in zip(at_points, simulated, strict=True)]
        if out is not None:
            with outputs.write(out) as part:
                write_trajectories(part, written, checks, forces)
        if plot is not None:
            with outputs.write(plot) as part:
                plot_predictions(part, found, simulated)
    if as_json:
        typer.echo(to_json(written, checks, forces))
        return
    for number, trajectory in enumerate(found):
        typer.echo(_readable(number, trajectory, checks[number] if checks else None))
        if fitted := getattr(written[number], "fitted", None):
            typer.echo(
                f"  predicted on the protocol fitted to the {len(written[number].time)} points: {fitted.words()}"
            )


def export(
    name: Annotated[str, typer.Argument(help="Name of a published model, or model directory.")],
    file_format: Annotated[str, typer.Option("--format", help="Format of the file, onnx.")] = "onnx",
    out: Annotated[Path | None, typer.Option(help="The file. Default: model.onnx in the model directory.")] = None,
    models: FoundOption = None,
    architecture: ArchitectureOption = None,
) -> None:
    """Write a trained model as one ONNX file, from physical inputs to the physical force."""
    from bem._support.outputs import Outputs, require_suffix
    from surrogate.architectures.registry import load_architectures
    from surrogate.inference.model_files import find_model

    if file_format != "onnx":
        raise ValueError(f"Expected the format onnx. Received: {shown(file_format)}")
    require_suffix(out, (".onnx",))
    folder = find_model(name, models)
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


def _protocols(table: Any, options: dict[str, float | None]) -> tuple[list[Any], Any]:
    import numpy as np

    from bem.protocol import LoadingProtocol
    from surrogate.inference.checks import checked_tabor

    given = {key: value for key, value in options.items() if value is not None}
    if table is None:
        if missing := [f"--{key.replace('_', '-')}" for key in options if key not in given]:
            raise ValueError(f"Expected --in FILE, or a complete protocol. Received: no {', '.join(missing)}")
        columns = {key: np.array([value]) for key, value in given.items()}
    elif given:
        raise ValueError(f"Expected protocols from --in FILE or from options, not both. Received: {', '.join(given)}")
    else:
        columns = table.columns
    protocols = []
    for number, row in enumerate(zip(*(columns[key] for key in options), strict=True)):
        values = dict(zip(options, map(float, row), strict=True))
        try:
            mu = float(checked_tabor(values.pop("tabor"), 1)[0])
            protocols.append(LoadingProtocol(**values))
            protocols[-1].history(mu)
        except ValueError as error:
            where = "from options" if table is None else table.where(number)
            raise ValueError(f"Expected a valid protocol. Received: one {where}: {error}") from error
    return protocols, columns["tabor"]


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


def _readable(number: int, found: Any, check: dict[str, float] | None) -> str:
    line = (
        f"trajectory {number}: pull-off force {found.pull_off_force:.5g} at time {found.pull_off_time:.5g}, "
        f"hysteresis {found.hysteresis:.5g}, max compression {found.max_compression:.5g}"
    )
    if found.work() < 0.0:
        line += f", work {found.work():.5g}: the contact gave energy back; not dissipation"
    if found.completed and not found.detached:
        line += ", still attached at the end: the pull-off force is the largest so far"
    if check is None:
        return line
    if check["solver_status"] != "completed":
        return f"{line}\n  against the solver: nothing to compare, it did not finish: {check['solver_status']}"
    other = check["model_modulus_ratio"] not in (None, check["modulus_ratio"])
    material = f" of another material (modulus ratio {check['modulus_ratio']:g})" if other else ""
    return (
        f"{line}\n  against the solver{material}: pull-off force off by {check['pull_off_percent']:.2f} % "
        f"({check['pull_off_on_steps_percent']:.2f} % on the measurement steps), hysteresis by "
        f"{check['hysteresis_percent']:.2f} % ({check['hysteresis_on_steps_percent']:.2f} %), "
        f"force by {100 * check['force_rms']:.2f} % of its range (rms)"
    )
