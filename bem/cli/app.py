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
from bem._support.outputs import IMAGES, Outputs, require_suffix
from bem._support.wording import shown
from bem.cli import lab
from bem.cli.campaign import register

app = typer.Typer(
    help="Adhesive contact of a rigid sphere with a viscoelastic half-space. All quantities are dimensionless: "
    "indentation in h0, time in retardation times, force in pi R dgamma (tension positive).",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

MATERIAL_HELP = (
    "elastic, sls:K (standard linear solid of modulus ratio K = E0/Einf), or prony:C1@T1,C2@T2,... (retardation "
    "strengths as fractions of the relaxed compliance, at retardation times)."
)

ADHESION_HELP = (
    "Traction law: lennard-jones, constant-stress (Maugis-Dugdale) or exponential; none for impenetrable surfaces."
)
TIMES_HELP = "Instants of a prescribed force, separated by commas; in place of a cycle."
FORCES_HELP = "Force at these times, separated by commas, linear between them,"
STILL_ATTACHED = "still attached at the end: the pull-off force is the largest so far"

add_version(app, "bem", __version__)
register(app)
lab.register(app)


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


@app.command()
def simulate(
    tabor: Annotated[float, typer.Option(help="Tabor parameter mu: 0.2 is long-ranged (DMT), 3 short-ranged (JKR).")],
    peak_indentation: Annotated[float | None, typer.Option(help="Indentation held during the dwell, in h0.")] = None,
    loading_rate: Annotated[float | None, typer.Option(help="Speed of approach, in h0 per retardation time.")] = None,
    unloading_rate: Annotated[
        float | None, typer.Option(help="Speed of withdrawal, in h0 per retardation time.")
    ] = None,
    dwell_time: Annotated[float, typer.Option(help="Time at the peak, in retardation times.")] = 0.0,
    start_indentation: Annotated[
        float | None, typer.Option(help="Indentation at the start and the end, in h0; by default -pi^(2/3) mu.")
    ] = None,
    times: Annotated[str | None, typer.Option(help=TIMES_HELP)] = None,
    forces: Annotated[str | None, typer.Option(help=f"{FORCES_HELP} in pi R dgamma, tension positive.")] = None,
    spring: Annotated[
        float | None, typer.Option(help="Stiffness between stage and sphere, in pi R dgamma / h0; none by default.")
    ] = None,
    material: Annotated[str, typer.Option(help=MATERIAL_HELP)] = "sls:0.1",
    adhesion: Annotated[str, typer.Option("--adhesion", "--traction", help=ADHESION_HELP)] = "lennard-jones",
    initial_state: Annotated[str, typer.Option(help="relaxed or glassy.")] = "relaxed",
    accuracy: Annotated[
        str, typer.Option(help="draft, standard, reference, or a target relative error such as 1e-3.")
    ] = "standard",
    as_json: Annotated[bool, typer.Option("--json", help="Print summary and arrays as JSON.")] = False,
    csv: Annotated[
        Path | None, typer.Option(help="Write time, indentation, force, contact radius, stage here.")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw force history and loop here (.png, .pdf, .svg).")] = None,
) -> None:
    """Simulate one load-dwell-unload cycle, or a prescribed force, and print a summary.

    Either a cycle is given (peak-indentation, loading-rate, unloading-rate), or times and forces.

    Example: bem simulate --tabor 3.2 --peak-indentation 15 --loading-rate 1000 --dwell-time 0.008 --unloading-rate 1000
    --plot loop.png
    """
    from bem.protocol import ForceProtocol, LoadingProtocol
    from bem.scene import Scene
    from bem.solver.simulation import simulate as run

    scene = Scene(tabor=tabor, material=parse_material(material), adhesion=parse_adhesion(adhesion), spring=spring)
    cycle = {"peak_indentation": peak_indentation, "loading_rate": loading_rate, "unloading_rate": unloading_rate}
    protocol: Any
    if one_of_cycle_and_forces(cycle, times, forces):
        protocol = ForceProtocol(parse_numbers("times", times), parse_numbers("forces", forces))
    else:
        protocol = LoadingProtocol(**cycle, dwell_time=dwell_time, start_indentation=start_indentation)  # type: ignore[arg-type]
    require_suffix(plot, IMAGES)
    with Outputs(csv, plot) as outputs:
        trajectory = run(scene, protocol, parse_accuracy(accuracy), initial_state=initial_state)
        if csv is not None:
            with outputs.write(csv) as part:
                write_csv(trajectory, part)
        if plot is not None and trajectory.time.size == 0:
            outputs.forgo(plot)
            typer.echo(f"bem: {plot} is not written, because there is nothing to draw", err=True)
        elif plot is not None:
            from bem.plots import plot_trajectory

            with outputs.write(plot) as part:
                plot_trajectory(trajectory, part, title=title(scene, protocol))
    typer.echo(to_json(trajectory) if as_json else readable(trajectory))
    if not trajectory.completed:
        raise typer.Exit(1)


def parse_material(text: str) -> Any:
    """The material a word describes; see `MATERIAL_HELP`."""
    from bem.materials import Elastic, PronySeries, StandardLinearSolid

    kind, _, details = text.partition(":")
    try:
        if kind == "elastic" and not details:
            return Elastic()
        if kind == "sls":
            return StandardLinearSolid(float(details))
        if kind == "prony":
            terms = [term.split("@") for term in details.split(",")]
            return PronySeries([float(c) for c, _ in terms], [float(t) for _, t in terms])
    except ValueError as error:
        if "received" in str(error):
            raise
    raise ValueError(f"material must be {MATERIAL_HELP.rstrip('.')}; received {shown(text)}")


def one_of_cycle_and_forces(cycle: dict[str, Any], times: str | None, forces: str | None) -> bool:
    """Whether a force is prescribed and not a cycle.

    Raises:
        ValueError: both are given, or a part of either is missing.
    """
    given = [name for name, value in cycle.items() if value is not None]
    if (times is None) != (forces is None):
        raise ValueError(
            f"times and forces must be given together; received {'times' if forces is None else 'forces'} alone"
        )
    if forces is not None and given:
        raise ValueError(
            f"either a cycle or times and forces must be given; received both, {', '.join(given)} and forces"
        )
    missing = [name for name in cycle if name not in given]
    if forces is None and missing:
        raise ValueError(f"{', '.join(missing)} must be given, or times and forces; received neither")
    return forces is not None


def parse_numbers(name: str, text: str | None) -> list[float]:
    """Numbers separated by commas."""
    try:
        return [float(number) for number in (text or "").split(",")]
    except ValueError as error:
        raise ValueError(f"{name} must be numbers separated by commas; received {shown(text)}") from error


def parse_adhesion(text: str) -> Any:
    """The adhesion a word names."""
    from bem.tractions import LAWS

    if text not in LAWS:
        raise ValueError(f"adhesion must be {', '.join(LAWS)}; received {shown(text)}")
    return LAWS[text]()


def title(scene: Any, protocol: Any) -> str:
    """Scene and protocol in one line."""
    material = type(scene.material).__name__.replace("StandardLinearSolid", "standard linear solid")
    if hasattr(scene.material, "modulus_ratio"):
        material += f" of modulus ratio {scene.material.modulus_ratio:g}"
    contact = f"Tabor parameter {scene.tabor:g}, {material}"
    if not hasattr(protocol, "peak_indentation"):
        return f"{contact}; forces {', '.join(f'{force:g}' for force in protocol.forces)}"
    return (
        f"{contact}; indented to {protocol.peak_indentation:g} at rate "
        f"{protocol.loading_rate:g}, held for {protocol.dwell_time:g}, unloaded at rate {protocol.unloading_rate:g}"
    )


def write_csv(trajectory: Any, path: Path) -> None:
    """Write the arrays as comma-separated columns with a header."""
    import numpy as np

    names = arrays_of(trajectory)
    np.savetxt(
        path,
        np.column_stack([getattr(trajectory, name) for name in names]),
        delimiter=",",
        header=",".join(names),
        comments="",
        fmt="%.10g",
    )


def to_json(trajectory: Any) -> str:
    """Summary and arrays as JSON; NaN, which JSON does not have, becomes null."""
    from bem._support.plain_json import plain

    return json.dumps(plain(trajectory.summary() | {name: getattr(trajectory, name) for name in arrays_of(trajectory)}))


def arrays_of(trajectory: Any) -> tuple[str, ...]:
    """Names of the arrays that are written; the stage has one of its own where a spring holds the sphere."""
    arrays = ("time", "indentation", "force", "contact_radius")
    return arrays if trajectory.spring is None else (*arrays, "stage")


def readable(trajectory: Any) -> str:
    """A short summary for people."""
    stats = trajectory.stats
    lines = [f"status           {trajectory.status}"]
    if trajectory.completed:
        lines += [
            f"pull-off force   {trajectory.pull_off_force:.5g}  at time {trajectory.pull_off_time:.6g}",
            f"max compression  {trajectory.max_compression:.5g}",
            f"hysteresis       {trajectory.hysteresis:.5g}",
            f"work             {work_words(trajectory)}",
            f"end force        {trajectory.end_force:.5g}",
        ]
        if not trajectory.detached:
            lines.append(f"detached         no, {STILL_ATTACHED}")
    lines += [
        f"jump             at indentation {jump.indentation:.5g}{moved_words(jump)}: "
        f"force {jump.force_before:.4g} -> {jump.force_after:.4g}"
        for jump in trajectory.jumps
    ]
    lines.append(
        f"cost             {1e3 * stats.seconds:.1f} ms, {stats.steps} steps, {stats.nodes:.0f} nodes, "
        f"target error {trajectory.accuracy:g}"
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


def app_main() -> None:
    """Run the command; a user's mistake becomes one sentence on standard error and exit code 2."""
    run_command(app, "bem")


if __name__ == "__main__":
    app_main()
