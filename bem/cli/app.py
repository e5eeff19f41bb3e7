"""The `bem` command: simulate one contact, or run a campaign of thousands.

A user's mistake prints one sentence and exits with code 2; an unfinished simulation prints its status and exits with 1.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from bem import __version__
from bem._support.command_line import (
    FIRST_PROTOCOL,
    FIRST_TABOR,
    HELP_NAMES,
    add_version,
    first_default,
    parse_accuracy,
    run_command,
)
from bem._support.outputs import Outputs, default_picture
from bem._support.wording import plain_table
from bem.cli import arguments, campaign, lab
from bem.cli.arguments import (
    STILL_ATTACHED,
    Adhesion,
    Indenter,
    Material,
    Number,
    Text,
    in_contact,
    in_protocol,
    option,
    say_written,
    write,
)

app = typer.Typer(
    cls=lab.UnitGroup,
    context_settings=HELP_NAMES,
    rich_markup_mode="markdown",
    help="Adhesive contact of a rigid sphere with a viscoelastic half-space. All quantities are dimensionless: "
    "indentation in h0, time in retardation times, force in pi R dgamma (tension positive).",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

TIMES = "Instants of a prescribed force, separated by commas; in place of a cycle."
FORCES = "Force at these times, separated by commas, linear between them, in pi R dgamma, tension positive."

ACCURACY = "draft, standard, reference, or a target relative error such as 1e-3."
Tabor = Annotated[float, in_contact("Tabor parameter mu: 0.2 is long-ranged (DMT), 3 short-ranged (JKR).")]
Spring = Annotated[Number, in_contact("Stiffness between stage and sphere, in pi R dgamma / h0; none by default.")]
InitialState = Annotated[
    Literal["relaxed", "glassy"], in_contact("As if the sphere had always been there, or had just arrived.")
]
Peak = Annotated[
    Number, in_protocol("Indentation held during the dwell, in h0.", show_default=first_default("peak_indentation"))
]
LoadingRate = Annotated[
    Number, in_protocol("Speed of approach, in h0 per retardation time.", show_default=first_default("loading_rate"))
]
UnloadingRate = Annotated[
    Number,
    in_protocol("Speed of withdrawal, in h0 per retardation time.", show_default=first_default("unloading_rate")),
]
DwellTime = Annotated[
    Number,
    in_protocol("Time at the peak, in retardation times.", show_default=f"{first_default('dwell_time')}, else 0"),
]
Start = Annotated[Number, in_protocol("Indentation at the start and the end, in h0; by default -pi^(2/3) mu.")]

add_version(app, "bem", __version__)


@app.command()
def simulate(
    tabor: Tabor = FIRST_TABOR,
    material: Material = "sls:0.1",
    adhesion: Adhesion = "lennard-jones",
    indenter: Indenter = "paraboloid",
    spring: Spring = None,
    initial_state: InitialState = "relaxed",
    peak_indentation: Peak = None,
    loading_rate: LoadingRate = None,
    unloading_rate: UnloadingRate = None,
    dwell_time: DwellTime = None,
    start_indentation: Start = None,
    times: Annotated[Text, in_protocol(TIMES)] = None,
    forces: Annotated[Text, in_protocol(FORCES)] = None,
    accuracy: Annotated[str, option(ACCURACY)] = "standard",
    as_json: arguments.Json = False,
    csv: arguments.Csv = None,
    plot: arguments.Plot = None,
    filmstrip: arguments.Filmstrip = None,
    animate: arguments.Animate = None,
) -> None:
    """Simulate one load-dwell-unload cycle, or a prescribed force, and print a summary.

    Give a cycle (peak-indentation, loading-rate, unloading-rate), or times and forces; without either, the paper's
    sample protocol (1) is simulated. With --radius, all quantities are in newtons, metres and seconds:
    `bem simulate-si --help` lists the options.

    Example: bem simulate --tabor 3.2 --peak-indentation 15 --loading-rate 1000 --dwell-time 0.008 --unloading-rate 1000
    --plot loop.png
    """
    import numpy as np

    from bem._support.text_files import plain
    from bem.results.plots import title_of
    from bem.simulation import simulate as run

    scene = arguments.scene_of(tabor, material, adhesion, spring, indenter)
    cycle = {"peak_indentation": peak_indentation, "loading_rate": loading_rate, "unloading_rate": unloading_rate}
    protocol = _protocol_of(cycle, dwell_time, start_indentation, times, forces)
    plot = plot or default_picture("contact", as_json, csv, filmstrip, animate)
    arguments.require_pictures(plot, filmstrip, animate)
    with Outputs(csv, plot, filmstrip, animate) as outputs:
        profiles = arguments.FRAMES if filmstrip or animate else None
        trajectory = run(scene, protocol, parse_accuracy(accuracy), initial_state=initial_state, profiles=profiles)
        arrays = {name: column.values for name, column in trajectory.columns().items() if name != "unloading"}

        def tabulated(temporary: Path) -> None:
            table = np.column_stack(list(arrays.values()))
            np.savetxt(temporary, table, delimiter=",", header=",".join(arrays), comments="", fmt="%.10g")

        def plotted(temporary: Path) -> None:
            trajectory.plot(title=title_of(scene, protocol)).savefig(temporary, dpi=150)

        write(outputs, csv, tabulated)
        for path, draw in ((plot, plotted), (filmstrip, trajectory.filmstrip), (animate, trajectory.animate)):
            if path is not None and (trajectory.time.size == 0 or (path != plot and not trajectory.profiles)):
                typer.echo(f"bem: {path} is not written, because there is nothing to draw", err=True)
            else:
                write(outputs, path, draw)
    heading = f"{title_of(scene, protocol)}\n\n"
    typer.echo(json.dumps(plain(trajectory.summary() | arrays)) if as_json else heading + readable(trajectory))
    say_written(outputs, err=as_json)
    if not trajectory.completed:
        raise typer.Exit(1)


def _protocol_of(
    cycle: dict[str, Any], dwell_time: Number, start_indentation: Number, times: Text, forces: Text
) -> Any:
    """The prescribed force, or the cycle; the paper's sample protocol (1) where neither is given."""
    from bem.problem.protocol import ForceProtocol, LoadingProtocol

    if {*cycle.values(), times, forces} == {None}:
        cycle = FIRST_PROTOCOL
    if arguments.by_force(cycle, times, forces):
        return ForceProtocol(arguments.parse_numbers("times", times), arguments.parse_numbers("forces", forces))
    held = {"dwell_time": cycle.get("dwell_time", 0.0) if dwell_time is None else dwell_time}
    return LoadingProtocol(**cycle | held, start_indentation=start_indentation)


app.command("simulate-si")(lab.simulate_si)
for command in (lab.fit, campaign.campaign, campaign.merge, campaign.verify):
    app.command()(command)


@app.command("compile")
def compile_kernels() -> None:
    """Compile the solver for this processor now, so that the first simulation starts at once; `make setup` does it."""
    import numpy as np

    from bem._support.interpolation import ForceInterpolant
    from bem.simulation import load_kernels

    load_kernels()
    ForceInterpolant(np.arange(3.0), np.arange(3.0), []).at(np.array([0.5]))
    ForceInterpolant(np.arange(3.0), np.arange(3.0), []).integrals()
    typer.echo("bem: the solver is compiled")


def app_main() -> None:
    """Run the command; a user's mistake becomes one sentence on standard error and exit code 2."""
    run_command(app, "bem")


def readable(trajectory: Any) -> str:
    """A short table for people, and what else there is to say."""
    from bem._support.tabular import UNITS

    lines = []
    if trajectory.completed:
        pulled, pressed = trajectory.pull_off_force > 0.0, trajectory.max_compression < 0.0
        values = {
            "pull-off force": ("pull_off_force", pulled),
            "pull-off time": ("pull_off_time", pulled),
            "largest compression": ("max_compression", pressed),
            "hysteresis": ("hysteresis", True),
            "end force": ("end_force", True),
        }
        rows = [("quantity (tension positive)", "value", "unit")]
        rows += [
            (label, f"{getattr(trajectory, name):.5g}" if exists else "none", UNITS[name])
            for label, (name, exists) in values.items()
        ]
        lines = [plain_table(rows), ""]
    if trajectory.status != "completed":
        lines.append(f"status: {trajectory.status}")
    lines += work_lines(trajectory) if trajectory.completed else []
    if trajectory.pull_off_force > 0.0 and not trajectory.detached:
        lines.append(STILL_ATTACHED)
    lines += [
        f"jump at indentation {jump.indentation:.5g}{moved_text(jump)}: "
        f"force {jump.force_before:.4g} -> {jump.force_after:.4g}"
        for jump in trajectory.jumps
    ]
    stats = trajectory.stats
    error = "expected error" if stats.method == "sharp crack" else "target error"
    lines.append(f"cost: {1e3 * stats.seconds:.1f} ms, {stats.steps} steps, {error} {trajectory.accuracy:g}")
    return "\n".join(lines)


def moved_text(jump: Any) -> str:
    """Where a jump takes the sphere, if elsewhere."""
    if math.isnan(jump.indentation_after):
        return " -> flown off"
    before, after = f"{jump.indentation:.5g}", f"{jump.indentation_after:.5g}"
    return "" if before == after else f" -> {after}"


def work_lines(trajectory: Any) -> list[str]:
    """What a negative work means, if there is one."""
    from bem._support.tabular import UNITS

    work = trajectory.work()
    if work >= 0.0 or -work <= trajectory.accuracy * trajectory.turnover():
        return []
    return [f"work {work:.5g} {UNITS['hysteresis']}: the contact gave energy back; not dissipation"]
