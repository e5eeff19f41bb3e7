"""The command `surrogate predict --radius ...`, also called `surrogate predict-si`: newtons, metres and seconds."""

from __future__ import annotations

import json
import warnings
from typing import Annotated, Any

import typer

from bem._support.command_line import Commands


class UnitGroup(Commands):
    """Commands, of which `predict` with a radius is the one in SI units."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Choose the command by its name, and `predict` by whether it names a radius too."""
        if args and args[0] == "predict" and any(word.partition("=")[0] == "--radius" for word in args[1:]):
            args = ["predict-si", *args[1:]]
        return super().resolve_command(ctx, args)


def _option(text: str, *names: str) -> Any:
    return typer.Option(*names, help=text)


def predict_si(
    name: Annotated[str, typer.Argument(help="fast, accurate, or a folder (./NAME).")],
    radius: Annotated[str, _option("Radius of the sphere, e.g. 50um; a plain number is in m.")],
    work_of_adhesion: Annotated[str, _option("e.g. 50mJ/m2; a plain number is in J/m2.")],
    peak_indentation: Annotated[str, _option("e.g. 1um.")],
    loading_rate: Annotated[str, _option("Speed of approach, e.g. 2um/s.")],
    unloading_rate: Annotated[str, _option("Speed of withdrawal, e.g. 2um/s.")],
    dwell_time: Annotated[str, _option("Time at the peak, e.g. 0.5s.")],
    material: Annotated[str, _option("As of `bem simulate`, e.g. polyurea or prony:0.3@0.1,0.4@10.")] = "elastic",
    modulus: Annotated[str | None, _option("Relaxed Young's modulus; by default that of a library's material.")] = None,
    poisson_ratio: Annotated[
        float | None, _option("Poisson's ratio; 0.5 by default, or that of a library's material.")
    ] = None,
    gap: Annotated[str | None, _option("Equilibrium gap; 0.3nm by default.")] = None,
    retardation_time: Annotated[str | None, _option("Unit of the material's times, e.g. 100ms.")] = None,
    coverage: Annotated[float, _option("Share of true values that intervals contain.")] = 0.9,
    as_json: Annotated[bool, _option("Print summary and arrays in SI as JSON.", "--json")] = False,
) -> None:
    """Predict one load-dwell-unload cycle in newtons, metres and seconds.

    Above a Tabor parameter of 3 an effective range of adhesion is used, since models know small ones only.

    Example: surrogate predict fast --material polyurea --radius 5um --work-of-adhesion 50mJ/m2 --peak-indentation
    50nm --loading-rate 1um/s --unloading-rate 1um/s --dwell-time 10ms
    """
    import surrogate
    from bem._support.text_files import plain
    from bem._support.wording import plain_table
    from bem.cli.lab import solid_of
    from bem.lab.setup import EFFECTIVE_TABOR, EffectiveRangeWarning, Setup
    from bem.lab.units import readable

    gaps: dict[str, Any] = {} if gap is None else {"equilibrium_gap": gap}
    solid: dict[str, Any] = solid_of(material, modulus, poisson_ratio, retardation_time)
    setup = Setup(radius=radius, work_of_adhesion=work_of_adhesion, largest_tabor=EFFECTIVE_TABOR, **solid, **gaps)
    protocol = setup.protocol(
        peak_indentation=peak_indentation,
        loading_rate=loading_rate,
        unloading_rate=unloading_rate,
        dwell_time=dwell_time,
    )
    model = surrogate.load(name)
    with warnings.catch_warnings(record=True, action="always") as warned:
        curve = setup.predict(protocol, model, coverage=coverage)
    for warning in warned or ():
        if issubclass(warning.category, EffectiveRangeWarning | surrogate.ExtrapolationWarning):
            typer.echo(f"surrogate: {warning.message}", err=True)
    if as_json:
        arrays = {label: column.values for label, column in curve.columns().items()}
        typer.echo(json.dumps(plain(curve.summary() | {"tabor": setup.physical_tabor} | arrays)))
        return
    force, unit = readable(curve.pull_off_force, "N").split(" ")
    interval = " to ".join(readable(end, "N") for end in curve.pull_off_interval or ())
    depth = readable(float(curve.indentation.max()), "m").split(" ")
    rows = [
        ["quantity", "value", "unit", f"{100 * coverage:g} % interval"],
        ["pull-off force (tension)", force, unit, interval],
        ["compression, at most", *readable(-float(curve.tension.min()), "N").split(" "), ""],
        ["indentation, at most", *depth, ""],
    ]
    lines = [plain_table(rows), "", f"Tabor parameter {setup.physical_tabor:.4g}: {setup.regime}"]
    if setup.range_is_effective:
        lines.append(f"effective range {readable(setup.gap, 'm')}, Tabor parameter {setup.tabor:.3g}")
    typer.echo("\n".join(lines))
