"""The `bem` command: simulate one contact, or run a campaign of thousands.

A user's mistake prints one sentence and exits with code 2; an unfinished simulation prints its status and exits with 1.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from bem import __version__
from bem._support.command_line import add_version, parse_accuracy, run_command
from bem._support.outputs import IMAGES, Outputs, require_suffix
from bem.cli import lab
from bem.cli.arguments import (
    Adhesion,
    File,
    Indenter,
    Material,
    Number,
    Text,
    by_force,
    option,
    parse_numbers,
    scene_of,
    write,
)
from bem.cli.campaign import register
from bem.cli.summary import readable, title, to_json, write_csv

app = typer.Typer(
    help="Adhesive contact of a rigid sphere with a viscoelastic half-space. All quantities are dimensionless: "
    "indentation in h0, time in retardation times, force in pi R dgamma (tension positive).",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

TIMES = "Instants of a prescribed force, separated by commas; in place of a cycle."
FORCES = "Force at these times, separated by commas, linear between them, in pi R dgamma, tension positive."

FRAMES = 80
"""Profiles of a film."""

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
    filmstrip: Annotated[File, option("Draw the contact at its telling instants here (.png, .pdf, .svg).")] = None,
    animate: Annotated[File, option("Write the moving contact here (.gif; .mp4 by ffmpeg).")] = None,
) -> None:
    """Simulate one load-dwell-unload cycle, or a prescribed force, and print a summary.

    Either a cycle is given (peak-indentation, loading-rate, unloading-rate), or times and forces. With --radius, all
    quantities are in newtons, metres and seconds: `bem simulate-si --help` lists the options.

    Example: bem simulate --tabor 3.2 --peak-indentation 15 --loading-rate 1000 --dwell-time 0.008 --unloading-rate 1000
    --plot loop.png
    """
    from bem.film import require_film
    from bem.protocol import ForceProtocol, LoadingProtocol
    from bem.solver.simulation import simulate as run

    scene = scene_of(tabor, material, adhesion, spring, indenter)
    cycle = {"peak_indentation": peak_indentation, "loading_rate": loading_rate, "unloading_rate": unloading_rate}
    protocol: Any
    if by_force(cycle, times, forces):
        protocol = ForceProtocol(parse_numbers("times", times), parse_numbers("forces", forces))
    else:
        protocol = LoadingProtocol(**cycle, dwell_time=dwell_time, start_indentation=start_indentation)
    require_suffix(plot, IMAGES)
    require_suffix(filmstrip, IMAGES)
    require_film(animate)
    with Outputs(csv, plot, filmstrip, animate) as outputs:
        profiles = FRAMES if filmstrip or animate else None
        trajectory = run(scene, protocol, parse_accuracy(accuracy), initial_state=initial_state, profiles=profiles)
        write(outputs, csv, lambda part: write_csv(trajectory, part))

        def plotted(part: Path) -> None:
            trajectory.plot(title=title(scene, protocol)).savefig(part, dpi=150)

        for path, draw in ((plot, plotted), (filmstrip, trajectory.filmstrip), (animate, trajectory.animate)):
            if path is not None and (trajectory.time.size == 0 or (path != plot and not trajectory.profiles)):
                typer.echo(f"bem: {path} is not written, because there is nothing to draw", err=True)
            else:
                write(outputs, path, draw)
    typer.echo(to_json(trajectory) if as_json else readable(trajectory))
    if not trajectory.completed:
        raise typer.Exit(1)


lab.register(app)
register(app)


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
