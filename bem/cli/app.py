"""The `bem` command: simulate one contact, or run a campaign of thousands.

A user's mistake prints one sentence and exits with code 2; an unfinished simulation prints its status and exits with 1.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Any

import typer

from bem import __version__
from bem._support.command_line import add_version, parse_accuracy, run_command
from bem._support.outputs import Outputs
from bem.cli import arguments, campaign, lab
from bem.cli.arguments import STILL_ATTACHED, Adhesion, File, Indenter, Material, Number, Text, option, write

app = typer.Typer(
    cls=lab.UnitGroup,
    help="Adhesive contact of a rigid sphere with a viscoelastic half-space. All quantities are dimensionless: "
    "indentation in h0, time in retardation times, force in pi R dgamma (tension positive).",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

TIMES = "Instants of a prescribed force, separated by commas; in place of a cycle."
FORCES = "Force at these times, separated by commas, linear between them, in pi R dgamma, tension positive."

add_version(app, "bem", __version__)


@app.command()
def simulate(
    tabor: Annotated[float, option("Tabor parameter mu: 0.2 is long-ranged (DMT), 3 short-ranged (JKR).")],
    peak_indentation: Annotated[Number, option("Indentation held during the dwell, in h0.")] = None,
    loading_rate: Annotated[Number, option("Speed of approach, in h0 per retardation time.")] = None,
    unloading_rate: Annotated[Number, option("Speed of withdrawal, in h0 per retardation time.")] = None,
    dwell_time: Annotated[float, option("Time at the peak, in retardation times.")] = 0.0,
    start_indentation: Annotated[
        Number, option("Indentation at the start and the end, in h0; by default -pi^(2/3) mu.")
    ] = None,
    times: Annotated[Text, option(TIMES)] = None,
    forces: Annotated[Text, option(FORCES)] = None,
    spring: Annotated[
        Number, option("Stiffness between stage and sphere, in pi R dgamma / h0; none by default.")
    ] = None,
    indenter: Indenter = "paraboloid",
    material: Material = "sls:0.1",
    adhesion: Adhesion = "lennard-jones",
    initial_state: Annotated[str, option("relaxed or glassy.")] = "relaxed",
    accuracy: Annotated[
        str, option("draft, standard, reference, or a target relative error such as 1e-3.")
    ] = "standard",
    as_json: Annotated[bool, typer.Option("--json", help="Print summary and arrays as JSON.")] = False,
    csv: Annotated[File, option("Write time, indentation, force, contact radius, stage here.")] = None,
    plot: Annotated[File, option("Draw force history and loop here (.png, .pdf, .svg).")] = None,
    filmstrip: arguments.Filmstrip = None,
    animate: arguments.Animate = None,
) -> None:
    """Simulate one load-dwell-unload cycle, or a prescribed force, and print a summary.

    Either a cycle is given (peak-indentation, loading-rate, unloading-rate), or times and forces. With --radius, all
    quantities are in newtons, metres and seconds: `bem simulate-si --help` lists the options.

    Example: bem simulate --tabor 3.2 --peak-indentation 15 --loading-rate 1000 --dwell-time 0.008 --unloading-rate 1000
    --plot loop.png
    """
    import numpy as np

    from bem._support.text_files import plain
    from bem.plots import title_of
    from bem.protocol import ForceProtocol, LoadingProtocol
    from bem.solver.simulation import simulate as run

    scene = arguments.scene_of(tabor, material, adhesion, spring, indenter)
    cycle = {"peak_indentation": peak_indentation, "loading_rate": loading_rate, "unloading_rate": unloading_rate}
    protocol: Any
    if arguments.by_force(cycle, times, forces):
        protocol = ForceProtocol(arguments.parse_numbers("times", times), arguments.parse_numbers("forces", forces))
    else:
        protocol = LoadingProtocol(**cycle, dwell_time=dwell_time, start_indentation=start_indentation)
    arguments.require_pictures(plot, filmstrip, animate)
    with Outputs(csv, plot, filmstrip, animate) as outputs:
        profiles = arguments.FRAMES if filmstrip or animate else None
        trajectory = run(scene, protocol, parse_accuracy(accuracy), initial_state=initial_state, profiles=profiles)
        arrays = {name: column.values for name, column in trajectory.columns().items() if name != "unloading"}

        def tabulated(part: Path) -> None:
            table = np.column_stack(list(arrays.values()))
            np.savetxt(part, table, delimiter=",", header=",".join(arrays), comments="", fmt="%.10g")

        def plotted(part: Path) -> None:
            trajectory.plot(title=title_of(scene, protocol)).savefig(part, dpi=150)

        write(outputs, csv, tabulated)
        for path, draw in ((plot, plotted), (filmstrip, trajectory.filmstrip), (animate, trajectory.animate)):
            if path is not None and (trajectory.time.size == 0 or (path != plot and not trajectory.profiles)):
                typer.echo(f"bem: {path} is not written, because there is nothing to draw", err=True)
            else:
                write(outputs, path, draw)
    typer.echo(json.dumps(plain(trajectory.summary() | arrays)) if as_json else readable(trajectory))
    if not trajectory.completed:
        raise typer.Exit(1)


app.command("simulate-si")(lab.simulate_si)
for command in (lab.fit, lab.fit_map, campaign.campaign, campaign.merge, campaign.verify):
    app.command()(command)


@app.command("compile")
def compile_kernels() -> None:
    """Compile the solver for this processor now, so that the first simulation starts at once; `make setup` does it."""
    import numpy as np

    from bem._support.interpolation import ForceInterpolant
    from bem.solver.simulation import load_kernels

    load_kernels()
    ForceInterpolant(np.arange(3.0), np.arange(3.0), []).at(np.array([0.5]))
    ForceInterpolant(np.arange(3.0), np.arange(3.0), []).integrals()
    typer.echo("bem: the solver is compiled")


def app_main() -> None:
    """Run the command; a user's mistake becomes one sentence on standard error and exit code 2."""
    run_command(app, "bem")


def readable(trajectory: Any) -> str:
    """A short summary for people."""
    stats = trajectory.stats
    lines = [f"status           {trajectory.status}"]
    if trajectory.completed:
        lines += [
            f"pull-off force   {trajectory.pull_off_force:.5g}  at time {trajectory.pull_off_time:.6g}"
            if trajectory.pull_off_force > 0.0
            else "pull-off force   none",
            f"max compression  {trajectory.max_compression:.5g}",
            f"hysteresis       {trajectory.hysteresis:.5g}",
            f"work             {work_words(trajectory)}",
            f"end force        {trajectory.end_force:.5g}",
        ]
        if trajectory.pull_off_force > 0.0 and not trajectory.detached:
            lines.append(f"detached         no, {STILL_ATTACHED}")
    lines += [
        f"jump             at indentation {jump.indentation:.5g}{moved_words(jump)}: "
        f"force {jump.force_before:.4g} -> {jump.force_after:.4g}"
        for jump in trajectory.jumps
    ]
    lines.append(
        f"cost             {1e3 * stats.seconds:.1f} ms, {stats.steps} steps, {stats.nodes:.0f} nodes, "
        f"target error {trajectory.accuracy:g}, {stats.multiply_adds:.3g} multiply-adds in {stats.attempts} "
        f"attempt{'s' * (stats.attempts > 1)}, {stats.failed_attempts or 'none'} failed"
    )
    return "\n".join(lines)


def moved_words(jump: Any) -> str:
    """Where a jump takes the sphere, if elsewhere."""
    if math.isnan(jump.indentation_after):
        return " -> flown off"
    return "" if jump.indentation_after == jump.indentation else f" -> {jump.indentation_after:.5g}"


def work_words(trajectory: Any) -> str:
    """The signed work, and what a negative one means."""
    work = trajectory.work()
    if work >= 0.0:
        return f"{work:.5g}"
    if -work <= trajectory.accuracy * trajectory.turnover():
        return f"{work:.5g}: zero to the accuracy"
    return f"{work:.5g}: the contact gave energy back; not dissipation"
