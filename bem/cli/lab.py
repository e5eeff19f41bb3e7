"""The commands in SI units: `bem fit`, and `bem simulate --radius ...` (also called `bem simulate-si`)."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from bem._support.command_line import Commands, one_sentence, parse_accuracy
from bem._support.outputs import IMAGES, Outputs, default_picture, require_suffix
from bem._support.wording import plain_table, shown
from bem.cli import arguments
from bem.cli.arguments import (
    MATERIAL_HELP,
    File,
    Material,
    Number,
    Text,
    by_force,
    entry_of,
    in_contact,
    in_output,
    in_protocol,
    option,
    panel,
    parse_material,
    say_written,
    write,
)

of_curve, of_model = map(panel, ("Measured curve", "Model"))
MODEL = "Model to fit; auto takes the simplest that describes the curve."
STIFFNESS = "Spring constant between stage (Z, piezo) and sphere, e.g. 0.2N/m; by default none"
Radius = Annotated[str, in_contact("Radius of the sphere, e.g. 50um; a plain number is in m.")]
Speed = Annotated[Text, of_curve("Speed of the stage, e.g. 2um/s, for files without time.")]
Stiffness = Annotated[Text, of_curve(f"{STIFFNESS}, or the file's own.")]
Sensitivity = Annotated[Text, of_curve("Deflection per volt, e.g. 50nm/V, for AFM files that hold volts.")]
ModelName = Annotated[Literal["auto", "hertz", "cone", "dmt", "jkr", "ting", "contact"], of_model(MODEL)]
Segment = Annotated[Literal["approach", "retract", "both"], of_model("Part of the curve that is fitted.")]
Thickness = Annotated[
    Text, of_model("Thickness of a layer bonded to a rigid ground, e.g. 20um; by default a half-space.")
]
FileSign = Annotated[
    Literal["tension", "compression"] | None,
    of_curve("Which force of the file is positive; by default compression, or as the file says."),
]
Poisson = Annotated[
    float | None, in_contact("Poisson's ratio of the half-space; 0.5 by default, or that of a library's material.")
]
Gap = Annotated[Text, in_contact("Equilibrium gap; 0.3nm by default.", "--gap", "--equilibrium-gap")]
Modulus = Annotated[Text, in_contact("Relaxed Young's modulus, e.g. 2MPa; by default that of a library's material.")]
START = "Indentation at the start and the end; by default just out of contact."
TIMES = "Instants of a prescribed force, e.g. 0s,1s,5s; in place of a cycle."
FORCES = "Force at these times, linear between them, e.g. 0uN,5uN,5uN; see --force-sign."
LARGEST = "Above this Tabor parameter use an effective, longer gap, as a film needs; by default never."
ForceSign = Annotated[Literal["tension", "compression"], option("Which force is positive.")]
Accuracy = Annotated[str, option("As in `bem simulate`.")]
ANGLE = "Angle between a cone and its axis, in degrees; --radius is then that of its apex."
HELD_BY_FREE = "used where --free leaves it out; else the fit finds it from the curve."
SOLID = (
    "Its modulus ratio is used where --free leaves it out. A Prony series is never fitted; its times are in seconds "
    "unless --retardation-time gives their unit."
)


class UnitGroup(Commands):
    """Commands, of which `simulate` with a radius is the one in SI units."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Choose the command by its name, and `simulate` by whether it names a radius too."""
        if args and args[0] == "simulate" and any(word.partition("=")[0] == "--radius" for word in args[1:]):
            args = ["simulate-si", *args[1:]]
        return super().resolve_command(ctx, args)


def simulate_si(
    radius: Radius,
    work_of_adhesion: Annotated[str, in_contact("Work of adhesion, e.g. 50mJ/m2; a plain number is in J/m2.")],
    modulus: Modulus = None,
    peak_indentation: Annotated[Text, in_protocol("Indentation held during the dwell, e.g. 1um.")] = None,
    loading_rate: Annotated[Text, in_protocol("Speed of approach, e.g. 2um/s.")] = None,
    unloading_rate: Annotated[Text, in_protocol("Speed of withdrawal, e.g. 2um/s.")] = None,
    dwell_time: Annotated[str, in_protocol("Time at the peak, e.g. 0.5s.")] = "0",
    start_indentation: Annotated[Text, in_protocol(START)] = None,
    times: Annotated[Text, in_protocol(TIMES)] = None,
    forces: Annotated[Text, in_protocol(FORCES)] = None,
    stiffness: Annotated[Text, in_contact(f"{STIFFNESS}.")] = None,
    poisson_ratio: Poisson = None,
    gap: Gap = None,
    retardation_time: Annotated[Text, in_contact("Unit of the material's times, e.g. 100ms.")] = None,
    material: Material = "elastic",
    largest_tabor: Annotated[Number, in_contact(LARGEST)] = None,
    force_sign: ForceSign = "tension",
    accuracy: Accuracy = "standard",
    as_json: Annotated[bool, in_output("Print summary and arrays in SI as JSON.", "--json")] = False,
    csv: Annotated[File, in_output("Write time, indentation, force and contact radius in SI here.")] = None,
    plot: Annotated[File, in_output(f"Draw the curve here (.png, .pdf, .svg). {arguments.PICTURE}")] = None,
    filmstrip: arguments.Filmstrip = None,
    animate: arguments.Animate = None,
) -> None:
    """Simulate one load-dwell-unload cycle, or a prescribed force, in newtons, metres and seconds.

    Either a cycle is given (peak-indentation, loading-rate, unloading-rate), or times and forces.

    Example: bem simulate --radius 50um --work-of-adhesion 50mJ/m2 --modulus 2MPa --peak-indentation 1um --loading-rate
    2um/s --unloading-rate 2um/s --material sls:0.3 --retardation-time 100ms --plot loop.png
    """
    from bem.lab.setup import EffectiveRangeWarning, Setup
    from bem.simulation import simulate as run

    ranges = {"equilibrium_gap": gap, "largest_tabor": largest_tabor}
    setup = Setup(
        radius=radius,
        work_of_adhesion=work_of_adhesion,
        stiffness=stiffness,
        **solid_of(material, modulus, poisson_ratio, retardation_time),
        **{name: value for name, value in ranges.items() if value is not None},
    )
    cycle = {"peak_indentation": peak_indentation, "loading_rate": loading_rate, "unloading_rate": unloading_rate}
    if of_forces := by_force(cycle, times, forces):
        pairs = {"times": (times or "").split(","), "forces": (forces or "").split(",")}
        protocol = setup.force_protocol(**pairs, force_sign=force_sign)
    else:
        protocol = setup.protocol(**cycle, dwell_time=dwell_time, start_indentation=start_indentation)
    plot = plot or default_picture("contact", as_json, csv, filmstrip, animate)
    arguments.require_pictures(plot, filmstrip, animate)
    recording = warnings.catch_warnings(record=True, action="always", category=EffectiveRangeWarning)
    with one_sentence("bem"), Outputs(csv, plot, filmstrip, animate) as outputs, recording as warned:
        curve = setup.simulate(protocol, parse_accuracy(accuracy), force_sign=force_sign)
        write(outputs, csv, curve.write)
        shown_first = "indentation" if of_forces else "force"
        write(outputs, plot, lambda temporary: curve.plot(over_time=shown_first).savefig(temporary, dpi=150))
        if filmstrip or animate:  # a force curve has no profiles
            contact = run(setup.scene(), protocol, parse_accuracy(accuracy), profiles=arguments.FRAMES)
            if contact.profiles is None:
                raise ValueError(
                    "a film needs a mesh, which is for a Tabor parameter of at most about 50; received "
                    f"{setup.tabor:.3g}; --largest-tabor 3 simulates an effective range"
                )
            write(outputs, filmstrip, lambda temporary: contact.filmstrip(temporary, setup))
            write(outputs, animate, lambda temporary: contact.animate(temporary, setup))
    for warning in warned or ():
        typer.echo(f"bem: {warning.message}", err=True)
    if material == "elastic" and retardation_time is not None:
        typer.echo("bem: an elastic solid does not relax: --retardation-time needs a --material like sls:0.3", err=True)
    typer.echo(_json_of(curve, setup) if as_json else _readable(curve, setup))
    say_written(outputs, err=as_json)


def _json_of(curve: Any, setup: Any) -> str:
    """Summary and arrays of a simulated force curve."""
    from bem._support.text_files import plain

    arrays = {name: column.values for name, column in curve.columns().items()}
    return json.dumps(plain(curve.summary() | {"detached": curve.detached, "tabor": setup.physical_tabor} | arrays))


def _readable(curve: Any, setup: Any) -> str:
    """A short table of a simulated force curve for people, and what else there is to say."""
    from bem.lab.units import readable

    values = {
        "pull-off force (tension)": (curve.pull_off_force, "N"),
        "compression, at most": (-float(curve.tension.min()), "N"),
        "indentation, at most": (float(curve.indentation.max()), "m"),
        "contact radius, at most": (float(curve.contact_radius.max()), "m"),
        "duration": (float(curve.time[-1]), "s"),
    }
    rows = [["quantity", "value", "unit"]]
    for quantity, (value, unit) in values.items():
        rows.append([quantity, *(readable(value, unit).split(" ") if value > 0.0 or unit != "N" else ("none", unit))])
    lines = [plain_table(rows), "", f"Tabor parameter {setup.physical_tabor:.4g}: {setup.regime}"]
    if curve.pull_off_force > 0.0 and not curve.detached:
        lines.append(arguments.STILL_ATTACHED)
    if curve.contact_radius.max() > setup.radius:
        lines.append("contact radius above the radius: no theory of a half-space holds; are the units right?")
    if setup.range_is_effective:
        lines.append(f"effective range {readable(setup.gap, 'm')}, Tabor parameter {setup.tabor:.3g}")
    lines.append(f"relative error of the force: {curve.accuracy:g}")
    return "\n".join(lines)


def fit(
    curve: Annotated[list[Path], typer.Argument(help="The measured curve; approach and retract may be two files.")],
    radius: Radius,
    stiffness: Stiffness = None,
    force_sign: FileSign = None,
    sensitivity: Sensitivity = None,
    speed: Speed = None,
    number: Annotated[int | None, of_curve("Number of the curve in a file of several, from 0.")] = None,
    model: ModelName = "auto",
    segment: Segment = "both",
    thickness: Thickness = None,
    half_angle: Annotated[float | None, of_model(ANGLE)] = None,
    free: Annotated[Text, of_model("Parameters to fit, separated by commas; by default all of the model.")] = None,
    modulus: Annotated[Text, in_contact(f"Relaxed Young's modulus, e.g. 2MPa; {HELD_BY_FREE}")] = None,
    work_of_adhesion: Annotated[Text, in_contact(f"Work of adhesion, e.g. 50mJ/m2; {HELD_BY_FREE}")] = None,
    poisson_ratio: Poisson = None,
    gap: Gap = None,
    retardation_time: Annotated[Text, in_contact(f"Retardation time, e.g. 100ms; {HELD_BY_FREE}")] = None,
    material: Annotated[str, in_contact(f"{MATERIAL_HELP} {SOLID}")] = "elastic",
    accuracy: Accuracy = "standard",
    out: Annotated[File, in_output("Write values, intervals and correlations here (.json).")] = None,
    plot: Annotated[File, in_output("Draw measurement, fit and residuals here (.png, .pdf, .svg).")] = None,
) -> None:
    """Fit Young's modulus, work of adhesion and relaxation to a measured force curve, with 95 % intervals.

    The simplest model that describes the curve is chosen, from Hertz to the contact with adhesion and relaxation; the
    summary shows those tried. A search of the contact takes some eight seconds at most, and says where it was cut.

    Example: bem fit curve.csv --radius 50um --plot fit.png --out fit.json
    """
    from bem._support.validation import collected
    from bem.lab.curve import ForceCurve
    from bem.lab.fitting import fit as run
    from bem.lab.fitting import guess_setup
    from bem.lab.setup import Setup

    require_suffix(plot, IMAGES)
    require_suffix(out, (".json",))
    properties = solid_of(material, modulus, poisson_ratio, retardation_time)
    properties |= {"work_of_adhesion": work_of_adhesion, "equilibrium_gap": gap, "thickness": thickness}
    properties = {name: value for name, value in properties.items() if value is not None}
    properties |= {"radius": radius, "half_angle": half_angle}
    names = None if free is None else tuple(name.strip() for name in free.split(","))
    options: dict[str, Any] = {"model": model, "segment": segment}
    with one_sentence("bem"), Outputs(out, plot) as outputs:
        how = {"stiffness": stiffness, "speed": speed, "number": number, "sensitivity": sensitivity}
        mistakes: list[str] = []
        with collected(mistakes):
            measured = ForceCurve.read(curve, force_sign=force_sign, **how)
        with collected(mistakes):  # with any modulus and work of adhesion in place of those that the curve tells
            Setup(**{"relaxed_modulus": 1.0, "work_of_adhesion": 1.0} | properties)
        if mistakes:
            raise ValueError("; ".join(mistakes))
        start = guess_setup(measured, **properties)
        result = run(measured, start, names, **options, accuracy=parse_accuracy(accuracy))
        text = json.dumps(result.to_dict(), indent=1) + "\n"
        write(outputs, out, lambda temporary: temporary.write_text(text, encoding="utf-8"))
        write(outputs, plot, result.plot)
    typer.echo(result.summary())
    say_written(outputs)


def solid_of(material: str, modulus: Any, poisson_ratio: float | None, retardation_time: str | None) -> dict[str, Any]:
    """What a `Setup` knows of the half-space by these options; the modulus is `None` where none of them says it."""
    entry = entry_of(material)
    if entry is not None and retardation_time is not None:
        raise ValueError(
            f"retardation_time must not be given with {entry.name}, whose times are in seconds; received "
            f"{shown(retardation_time)}"
        )
    properties = {"material": parse_material(material), "relaxed_modulus": None, "poisson_ratio": 0.5}
    properties |= {} if entry is None else {name: getattr(entry, name) for name in ("relaxed_modulus", "poisson_ratio")}
    options = {"relaxed_modulus": modulus, "poisson_ratio": poisson_ratio, "retardation_time": retardation_time}
    return properties | {name: value for name, value in options.items() if value is not None}
