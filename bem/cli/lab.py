"""The commands in SI units: `bem fit`, and `bem simulate --radius ...` (also called `bem simulate-si`)."""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from bem._support.command_line import one_sentence, parse_accuracy
from bem._support.outputs import IMAGES, Outputs, require_suffix
from bem._support.wording import shown
from bem.cli.arguments import one_of_cycle_and_forces, parse_material

RADIUS = "Radius of the sphere, e.g. 50um; a plain number is in m."
SIGN_HELP = "Which force is positive: tension or compression."


class UnitGroup(TyperGroup):
    """Commands, of which `simulate` with a radius is the one in SI units."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Choose the command by its name, and `simulate` by whether it names a radius too."""
        if args and args[0] == "simulate" and any(word.partition("=")[0] == "--radius" for word in args[1:]):
            args = ["simulate-si", *args[1:]]
        return super().resolve_command(ctx, args)


def register(app: typer.Typer) -> None:
    """Add the commands to an application."""
    app.info.cls = UnitGroup
    app.command("simulate-si")(simulate_si)
    app.command("fit")(fit_curve)


def simulate_si(
    radius: Annotated[str, typer.Option(help=RADIUS)],
    work_of_adhesion: Annotated[str, typer.Option(help="e.g. 50mJ/m2; a plain number is in J/m2.")],
    modulus: Annotated[str, typer.Option(help="Relaxed Young's modulus, e.g. 2MPa; a plain number is in Pa.")],
    peak_indentation: Annotated[str | None, typer.Option(help="e.g. 1um.")] = None,
    loading_rate: Annotated[str | None, typer.Option(help="Speed of approach, e.g. 2um/s.")] = None,
    unloading_rate: Annotated[str | None, typer.Option(help="Speed of withdrawal, e.g. 2um/s.")] = None,
    dwell_time: Annotated[str, typer.Option(help="Time at the peak, e.g. 0.5s.")] = "0",
    start_indentation: Annotated[
        str | None, typer.Option(help="Indentation at the start and the end; by default just out of contact.")
    ] = None,
    times: Annotated[
        str | None, typer.Option(help="Instants of a prescribed force, e.g. 0s,1s,5s; in place of a cycle.")
    ] = None,
    forces: Annotated[
        str | None, typer.Option(help="Force at these times, linear between them, e.g. 0uN,5uN,5uN; see --force-sign.")
    ] = None,
    stiffness: Annotated[
        str | None, typer.Option(help="Stiffness of a spring between stage and sphere, e.g. 0.2N/m; none by default.")
    ] = None,
    poisson_ratio: Annotated[float, typer.Option(help="Poisson's ratio of the half-space.")] = 0.5,
    gap: Annotated[str | None, typer.Option(help="Equilibrium gap; 0.3nm by default.")] = None,
    retardation_time: Annotated[str | None, typer.Option(help="Unit of the material's times, e.g. 100ms.")] = None,
    material: Annotated[str, typer.Option(help="elastic, sls:K or prony:C1@T1,...; as in `bem simulate`.")] = "elastic",
    largest_tabor: Annotated[
        float, typer.Option(help="Above this Tabor parameter an effective, longer gap is simulated.")
    ] = 3.0,
    force_sign: Annotated[str, typer.Option(help=SIGN_HELP)] = "tension",
    accuracy: Annotated[str, typer.Option(help="As in `bem simulate`.")] = "standard",
    csv: Annotated[
        Path | None, typer.Option(help="Write time, indentation, force and contact radius in SI here.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Draw the curve here (.png, .pdf, .svg): indentation over time under a force.")
    ] = None,
) -> None:
    """Simulate one load-dwell-unload cycle, or a prescribed force, in newtons, metres and seconds.

    Either a cycle is given (peak-indentation, loading-rate, unloading-rate), or times and forces.

    Example: bem simulate --radius 50um --work-of-adhesion 50mJ/m2 --modulus 2MPa --peak-indentation 1um --loading-rate
    2um/s --unloading-rate 2um/s --material sls:0.3 --retardation-time 100ms --plot loop.png
    """
    from bem.lab.setup import Setup
    from bem.lab.units import readable

    setup = Setup(
        radius=radius,
        work_of_adhesion=work_of_adhesion,
        relaxed_modulus=modulus,
        poisson_ratio=poisson_ratio,
        retardation_time=retardation_time,
        material=parse_material(material),
        largest_tabor=largest_tabor,
        stiffness=stiffness,
        **({} if gap is None else {"equilibrium_gap": gap}),
    )
    cycle = {"peak_indentation": peak_indentation, "loading_rate": loading_rate, "unloading_rate": unloading_rate}
    protocol: Any
    by_force = one_of_cycle_and_forces(cycle, times, forces)
    if by_force:
        pairs = {"times": (times or "").split(","), "forces": (forces or "").split(",")}
        protocol = setup.force_protocol(**pairs, force_sign=force_sign)  # type: ignore[arg-type]
    else:
        protocol = setup.protocol(**cycle, dwell_time=dwell_time, start_indentation=start_indentation)  # type: ignore[arg-type]
    require_suffix(plot, IMAGES)
    with one_sentence("bem"), Outputs(csv, plot) as outputs, _warnings_are_sentences():
        curve = setup.simulate(protocol, parse_accuracy(accuracy), force_sign=force_sign)
        if csv is not None:
            with outputs.write(csv) as part:
                curve.write(part)
        if plot is not None:
            with outputs.write(plot) as part:
                curve.plot(over_time="indentation" if by_force else "force").savefig(part, dpi=150)
    lines = {
        "Tabor parameter": f"{setup.physical_tabor:.4g}: {setup.regime}",
        "pull-off force": f"{readable(curve.pull_off_force, 'N')} (tension)",
        "compression": readable(-float(curve.tension.min()), "N") if curve.tension.min() < 0.0 else "none",
        "contact radius": f"{readable(float(curve.contact_radius.max()), 'm')} at most",
        "duration": readable(float(curve.time[-1]), "s"),
    }
    if setup.range_is_effective:
        lines["effective range"] = f"{readable(setup.gap, 'm')}, Tabor parameter {setup.tabor:.3g}"
    typer.echo("\n".join(f"{name:16} {text}" for name, text in lines.items()))


def fit_curve(
    curve: Annotated[list[Path], typer.Argument(help="The measured curve; approach and retract may be two files.")],
    radius: Annotated[str, typer.Option(help=RADIUS)],
    stiffness: Annotated[str | None, typer.Option(help="Stiffness of the cantilever or machine, e.g. 0.2N/m.")] = None,
    force_sign: Annotated[str, typer.Option(help=SIGN_HELP)] = "tension",
    speed: Annotated[str | None, typer.Option(help="Speed of the stage, e.g. 2um/s, for files without time.")] = None,
    free: Annotated[
        str | None,
        typer.Option(help="Parameters to fit, separated by commas; by default all that the curve calls for."),
    ] = None,
    modulus: Annotated[str | None, typer.Option(help="Relaxed Young's modulus: a first guess, or fixed.")] = None,
    work_of_adhesion: Annotated[str | None, typer.Option(help="A first guess, or fixed.")] = None,
    poisson_ratio: Annotated[float, typer.Option(help="Poisson's ratio of the half-space.")] = 0.5,
    gap: Annotated[str | None, typer.Option(help="Equilibrium gap; 0.3nm by default.")] = None,
    retardation_time: Annotated[str | None, typer.Option(help="A first guess, or fixed.")] = None,
    material: Annotated[str, typer.Option(help="elastic or sls:K: a first guess, or fixed.")] = "elastic",
    largest_tabor: Annotated[float, typer.Option(help="As in `bem simulate-si`.")] = 3.0,
    accuracy: Annotated[str, typer.Option(help="As in `bem simulate`.")] = "standard",
    out: Annotated[Path | None, typer.Option(help="Write values, intervals and correlations here (.json).")] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw measurement, fit and residuals here.")] = None,
) -> None:
    """Fit modulus, work of adhesion and relaxation to a measured force curve, with 95 % intervals.

    Example: bem fit curve.csv --radius 50um --plot fit.png --out fit.json
    """
    from bem.lab.fitting import fit
    from bem.lab.guess import guess_setup
    from bem.lab.reading import read

    require_suffix(plot, IMAGES)
    require_suffix(out, (".json",))
    solid = parse_material(material)
    if hasattr(solid, "compliances"):
        raise ValueError(f"material of a fit must be elastic or sls:K; received {shown(material)}")
    given = {
        "relaxed_modulus": modulus,
        "work_of_adhesion": work_of_adhesion,
        "equilibrium_gap": gap,
        "retardation_time": retardation_time,
    }
    known = {name: value for name, value in given.items() if value is not None}
    names = None if free is None else tuple(name.strip() for name in free.split(","))
    with one_sentence("bem"), Outputs(out, plot) as outputs:
        measured = read(curve, stiffness=stiffness, force_sign=force_sign, speed=speed)
        start = guess_setup(
            measured,
            radius=radius,
            material=solid,
            poisson_ratio=poisson_ratio,
            largest_tabor=largest_tabor,
            **known,
        )
        with _progress() as report:
            result = fit(measured, start, names, accuracy=parse_accuracy(accuracy), report=report)
        if out is not None:
            with outputs.write(out) as part:
                part.write_text(json.dumps(result.to_dict(), indent=1) + "\n", encoding="utf-8")
        if plot is not None:
            with outputs.write(plot) as part:
                result.plot(part)
    typer.echo(result.summary())


@contextmanager
def _progress() -> Iterator[Callable[[int, float], None] | None]:
    """A line on a terminal of how many simulations were made and how far the fit is; nothing elsewhere."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console

    with Console(stderr=True).status("the first simulation") as status:
        yield lambda done, misfit: status.update(f"{done} simulations, misfit {misfit:.3g} times the noise")


@contextmanager
def _warnings_are_sentences() -> Iterator[None]:
    """Print warnings of a setup as the command's own sentences."""
    from bem.lab.effective_range import EffectiveRangeWarning

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", EffectiveRangeWarning)
        yield
    for warning in caught:
        typer.echo(f"bem: {warning.message}", err=True)
