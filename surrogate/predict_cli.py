"""The commands `surrogate predict` and `surrogate export`."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Annotated, Any

import typer


def register(app: typer.Typer) -> None:
    """Add both commands to the command line."""
    app.command()(predict)
    app.command()(export)


def predict(
    name: Annotated[str, typer.Argument(help="A published model, a model directory, or an ONNX file.")],
    tabor: Annotated[float | None, typer.Option(help="Tabor parameter.")] = None,
    peak_indentation: Annotated[float | None, typer.Option(help="Indentation held during the dwell.")] = None,
    loading_rate: Annotated[float | None, typer.Option(help="Speed of approach.")] = None,
    dwell_time: Annotated[float | None, typer.Option(help="Time at the peak.")] = None,
    unloading_rate: Annotated[float | None, typer.Option(help="Speed of withdrawal.")] = None,
    source: Annotated[
        Path | None, typer.Option("--in", help="Protocols, or one history, as .csv or .json; see the user's guide.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write the trajectories here, .csv or .json.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print scalars and arrays as JSON.")] = False,
    plot: Annotated[Path | None, typer.Option(help="Draw force histories and loops here.")] = None,
    check: Annotated[bool, typer.Option(help="Run the solver beside it and report the errors.")] = False,
    modulus_ratio: Annotated[float, typer.Option(help="Modulus ratio of the check; the training's is 0.1.")] = 0.1,
    backend: Annotated[str, typer.Option(help="onnx or keras.")] = "onnx",
    models: Annotated[Path | None, typer.Option(help="Where models are published.")] = None,
) -> None:
    """Predict the force of a protocol, of many, or of any indentation history.

    Example: surrogate predict M1-concat --tabor 1 --peak-indentation 20 --loading-rate 10 --dwell-time 1
    --unloading-rate 10 --check --plot prediction.png
    """
    from bem.outputs import IMAGES, Outputs, require_suffix
    from surrogate.comparison import plot_predictions, simulate_same, solver_errors, solver_force
    from surrogate.predict_io import PROTOCOL_COLUMNS, read_table, to_json, write_trajectories

    require_suffix(out, (".csv", ".json"))
    require_suffix(plot, IMAGES)
    given = (tabor, peak_indentation, loading_rate, dwell_time, unloading_rate)
    options = dict(zip(PROTOCOL_COLUMNS, given, strict=True))
    table = read_table(source) if source is not None else None
    with Outputs(out, plot) as outputs:
        model = _load(name, models, backend)
        if table is not None and table.is_history:
            mus = [_tabor(table, options)]
            found = [_predict_history(model, table, mus[0])]
            protocols = [_as_protocol(table)] if check else []
        else:
            protocols, mus = _protocols(table, options)
            found = model.trajectories(protocols, tabor=mus)
        for number, trajectory in enumerate(found):
            for words in trajectory.extrapolated:
                typer.echo(f"warning: trajectory {number} extrapolates: {words}", err=True)

        simulated = simulate_same(protocols, mus, modulus_ratio) if check else None
        pairs = list(zip(found, simulated, strict=True)) if check else None
        checks = [solver_errors(*pair) for pair in pairs] if check else None
        forces = [solver_force(*pair) for pair in pairs] if check else None
        if out is not None:
            with outputs.write(out) as part:
                write_trajectories(part, found, checks, forces)
        if plot is not None:
            with outputs.write(plot) as part:
                plot_predictions(part, found, simulated)
    if as_json:
        typer.echo(to_json(found, checks, forces))
        return
    for number, trajectory in enumerate(found):
        typer.echo(_readable(number, trajectory, checks[number] if check else None))


def export(
    name: Annotated[str, typer.Argument(help="A published model, or a model directory.")],
    file_format: Annotated[str, typer.Option("--format", help="onnx.")] = "onnx",
    out: Annotated[Path | None, typer.Option(help="Write it here, and only here.")] = None,
    models: Annotated[Path | None, typer.Option(help="Where models are published.")] = None,
) -> None:
    """Write a trained model as one file that takes physical inputs, beside its weights unless `--out` says where."""
    from bem.outputs import Outputs, require_suffix
    from surrogate.backend import quiet_backend
    from surrogate.model_files import find_model

    if file_format != "onnx":
        raise ValueError(f"Expected the format onnx. Received: {file_format!r}")
    require_suffix(out, (".onnx",))
    folder = find_model(name, models)
    if not folder.is_dir():
        raise ValueError(f"Expected a model directory. Received: {folder}")
    written = folder / "model.onnx" if out is None else out
    with Outputs(written) as outputs:
        content = _exported(folder) if out is not None else None
        if content is None:
            quiet_backend()
            from surrogate.export import folder_content

            content = folder_content(folder)
        with outputs.write(written) as part:
            part.write_bytes(content)
    typer.echo(f"{written}: {len(content) / 1e6:.2f} MB")


def _exported(folder: Path) -> bytes | None:
    """The directory's own ONNX file, where it belongs to the weights and the scaling; that takes no Keras."""
    from surrogate.backends import ONNX_NAME, OnnxBackend
    from surrogate.model_files import read_run

    _, scaling = read_run(folder)
    try:
        found = OnnxBackend(folder / ONNX_NAME)
        found.require_weights_of(folder)
        found.require_scaling(scaling)
    except (ValueError, FileNotFoundError):
        return None
    return found.path.read_bytes()


def _load(name: str, models: Path | None, backend: str) -> Any:
    if backend == "keras":
        from surrogate.backend import quiet_backend

        quiet_backend()
    from surrogate.predictor import Surrogate

    return Surrogate.load(name, root=models, backend=backend)


def _protocols(table: Any, options: dict[str, float | None]) -> tuple[list[Any], Any]:
    import numpy as np

    from bem.protocol import LoadingProtocol
    from surrogate.checks import checked_tabor

    given = {key: value for key, value in options.items() if value is not None}
    if table is None:
        missing = [f"--{key.replace('_', '-')}" for key in options if key not in given]
        if missing:
            raise ValueError(f"Expected --in FILE, or a whole protocol. Missing: {', '.join(missing)}")
        columns = {key: np.array([value]) for key, value in given.items()}
    elif given:
        raise ValueError(f"Expected protocols from --in FILE or from options, not both. Received: {', '.join(given)}")
    else:
        columns = table.columns
    fields = [key for key in options if key != "tabor"]
    protocols = []
    for number, row in enumerate(zip(*(columns[key] for key in options), strict=True)):
        values = dict(zip(options, map(float, row), strict=True))
        try:
            mu = float(checked_tabor(values["tabor"], 1)[0])
            protocols.append(LoadingProtocol(**{key: values[key] for key in fields}))
            protocols[-1].history(mu)
        except ValueError as error:
            where = "from options" if table is None else table.where(number)
            raise ValueError(f"Expected a possible protocol. Received: one {where}: {error}") from error
    return protocols, columns["tabor"]


def _tabor(table: Any, options: dict[str, float | None]) -> float:
    """The Tabor parameter of a history: the file's, or the option's."""
    given = options["tabor"]
    unwanted = [key for key, value in options.items() if key != "tabor" and value is not None]
    if unwanted:
        raise ValueError(f"Expected --tabor, and no protocol, with a history. Received: {', '.join(unwanted)}")
    if given is None and table.tabor is None:
        raise ValueError("Expected --tabor, or a column of it, with a history. Received: no --tabor")
    if given is not None and table.tabor not in (None, given):
        raise ValueError(f"Expected the file's Tabor parameter {table.tabor!r}. Received: --tabor {given!r}")
    return table.tabor if given is None else given


def _predict_history(model: Any, table: Any, tabor: float) -> Any:
    import time

    from surrogate.extrapolation import ExtrapolationWarning, dwell_ends
    from surrogate.predicted import predicted_trajectory

    times, indentations, edge = (table.columns.get(key) for key in ("time", "indentation", "edge"))
    history = (times[None], indentations[None])
    marks = {"tabor": tabor, "edge": None if edge is None else edge[None]}
    (words,) = model.extrapolated(*history, **marks)
    clock = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)
        force = model.predict(*history, **marks)
    return predicted_trajectory(
        times,
        indentations,
        force[0],
        unloading_from=max(int(indentations.argmax()), dwell_ends(indentations, edge)[1]),
        extrapolated=words,
        model=model.name,
        seconds=time.perf_counter() - clock,
    )


def _as_protocol(table: Any) -> Any:
    from bem.protocol import PiecewiseLinearProtocol

    if len(table.columns["time"]) < 2:
        raise ValueError("Expected a history of at least two points. Received: one")
    return PiecewiseLinearProtocol(table.columns["time"], table.columns["indentation"])


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
    return (
        f"{line}\n  against the solver: pull-off force off by {check['pull_off_percent']:.2f} % "
        f"({check['pull_off_on_steps_percent']:.2f} % on the measurement steps), hysteresis by "
        f"{check['hysteresis_percent']:.2f} % ({check['hysteresis_on_steps_percent']:.2f} %), "
        f"force by {100 * check['force_rms']:.2f} % of its range (rms)"
    )
