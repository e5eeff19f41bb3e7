"""Options of the command line, and their words that become materials, laws, protocols and designs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from bem._support.outputs import IMAGES, Outputs, require_suffix
from bem._support.wording import shown

Text = str | None
Number = float | None
File = Path | None

MATERIAL_HELP = (
    "elastic, sls:K (standard linear solid of modulus ratio K = E0/Einf), or prony:C1@T1,C2@T2,... (retardation "
    "strengths as fractions of the relaxed compliance, at retardation times), or an entry of the materials library, "
    "such as sylgard_184, or a .toml file like its entries, whose times are in seconds."
)

PICTURE = "On a terminal, a new contact.png by default."
STILL_ATTACHED = "still attached at the end: the pull-off force is the largest so far"
ADHESION_HELP = "Traction law; constant-stress is Maugis-Dugdale's, none is for impenetrable surfaces."
INDENTER_HELP = "paraboloid, cone, or power:N for a profile that rises with the power N of the radius, 1 to 8."


def option(text: str, *names: str, **settings: Any) -> Any:
    """An option with its help; its name is the parameter's unless `names` say otherwise."""
    return typer.Option(*names, help=text, **settings)


def panel(name: str) -> Callable[..., Any]:
    """The function `option` for one panel of the help."""
    return partial(option, rich_help_panel=name)


in_protocol, in_contact, in_output = map(panel, ("Protocol", "Contact", "Output"))
Adhesion = Annotated[
    Literal["lennard-jones", "constant-stress", "exponential", "none"],
    in_contact(ADHESION_HELP, "--adhesion", "--traction"),
]
Indenter = Annotated[str, in_contact(INDENTER_HELP)]
Material = Annotated[str, in_contact(MATERIAL_HELP)]
Json = Annotated[bool, in_output("Print summary and arrays as JSON.", "--json")]
Csv = Annotated[File, in_output("Write time, indentation, force and contact radius here.")]
Plot = Annotated[File, in_output(f"Draw force history and loop here (.png, .pdf, .svg). {PICTURE}")]
Filmstrip = Annotated[File, in_output("Draw the contact at its most informative instants here (.png, .pdf, .svg).")]
Animate = Annotated[File, in_output("Write the moving contact here (.gif; .mp4 by ffmpeg).")]
FRAMES = 80
"""Profiles of a film."""


def require_pictures(plot: File, filmstrip: File, animate: File) -> None:
    """Raise ValueError where one of these files has a suffix that cannot be written."""
    from bem.results.film import require_film

    require_suffix(plot, IMAGES)
    require_suffix(filmstrip, IMAGES)
    require_film(animate)


def scene_of(tabor: float, material: str, adhesion: str, spring: float | None, indenter: str) -> Any:
    """The scene that these options describe."""
    from bem.problem.scene import Scene
    from bem.problem.tractions import LAWS

    return Scene(tabor, parse_material(material), LAWS[adhesion](), spring, parse_indenter(indenter))


def write(outputs: Outputs, path: File, save: Callable[[Path], Any]) -> None:
    """Write an output that is wanted."""
    if path is not None:
        with outputs.write(path) as temporary:
            save(temporary)


def say_written(outputs: Outputs, *, err: bool = False) -> None:
    """Tell the user which files were written."""
    if outputs.sentence:
        typer.echo(outputs.sentence, err=err)


def parse_indenter(text: str) -> Any:
    """The shape a word describes; see `INDENTER_HELP`."""
    from bem.problem.indenter import CONE, PARABOLOID, PowerLaw

    shape, _, exponent = text.partition(":")
    try:
        power = float(exponent) if shape == "power" else {"cone": CONE, "paraboloid": PARABOLOID}[text]
    except (KeyError, ValueError) as error:
        raise ValueError(f"indenter must be {INDENTER_HELP.rstrip('.')}; received {shown(text)}") from error
    return PowerLaw(power)


def parse_material(text: str) -> Any:
    """The material a word describes; see `MATERIAL_HELP`."""
    from bem.problem.materials import Elastic, PronySeries, StandardLinearSolid

    if (entry := entry_of(text)) is not None:
        return entry.material
    model, _, details = text.partition(":")
    try:
        if model == "elastic" and not details:
            return Elastic()
        if model == "sls":
            return StandardLinearSolid(float(details))
        if model == "prony":
            terms = [term.split("@") for term in details.split(",")]
            return PronySeries([float(c) for c, _ in terms], [float(t) for _, t in terms])
    except ValueError as error:
        if "received" in str(error):
            raise
    raise ValueError(f"material must be {MATERIAL_HELP.rstrip('.')}; received {shown(text)}")


def entry_of(text: str) -> Any:
    """The only entry of the materials library whose name begins with these words, or that of a file; else `None`."""
    from bem.materials_library import load, names

    if text.endswith(".toml"):
        return load(Path(text))
    matches = [name for name in names() if f"{name}_".startswith(f"{text}_")]
    return load(matches[0]) if len(matches) == 1 else None


def parse_solids(text: str) -> tuple[Any, float]:
    """The solids of a design that a word describes (`bem.cli.campaign.SOLIDS_HELP`), and their modulus ratio."""
    from bem.dataset.solids import Solids

    if (entry := entry_of(text)) is None:
        return Solids.of(text), 0.1
    ratio = entry.material.modulus_ratio
    if not ratio < 1.0:
        raise ValueError(f"solids must relax; received {text}, which is elastic")
    shares = entry.material.strengths / (1.0 - ratio)
    return Solids("spectrum", shares=tuple(shares.tolist()), times=tuple(entry.material.times.tolist())), ratio


def by_force(cycle: dict[str, Any], times: str | None, forces: str | None) -> bool:
    """Whether a force is prescribed and not a cycle.

    Raises:
        ValueError: both are given, or a part of either is missing.
    """
    options = {f"--{name.replace('_', '-')}": value for name, value in cycle.items()}
    specified = [option for option, value in options.items() if value is not None]
    if (times is None) != (forces is None):
        raise ValueError(
            f"--times and --forces must be given together; received --{'times' if forces is None else 'forces'} alone"
        )
    if forces is not None and specified:
        raise ValueError(
            f"either a cycle or --times and --forces must be given; received {', '.join(specified)} and --forces"
        )
    missing = [option for option in options if option not in specified]
    if forces is None and missing:
        raise ValueError(
            f"{', '.join(missing)} must be given, or --times and --forces; received {', '.join(specified) or 'neither'}"
        )
    return forces is not None


def parse_numbers(name: str, text: str | None) -> list[float]:
    """Numbers separated by commas."""
    try:
        return [float(number) for number in (text or "").split(",")]
    except ValueError as error:
        raise ValueError(f"{name} must be numbers separated by commas; received {shown(text)}") from error


def parse_ratio(text: str) -> float | tuple[float, ...]:
    """Read `0.1` or `0.01:1`, as given on the command line."""
    try:
        numbers = tuple(map(float, text.split(":")))
    except ValueError:
        raise ValueError(f"modulus-ratio must read VALUE or LOW:HIGH; received {shown(text)}") from None
    return numbers[0] if len(numbers) == 1 else numbers


def parse_ranges(texts: Iterable[str]) -> dict[str, tuple[float, float]]:
    """Read several of `tabor=0.2:3.2`, as given on the command line; a single number fixes the quantity."""
    ranges: dict[str, tuple[float, float]] = {}
    for text in texts:
        name, _, bounds = map(str.strip, text.partition("="))
        low, colon, high = bounds.partition(":")
        if name in ranges:
            raise ValueError(f"range must name a quantity once; received {shown(name)} twice")
        try:
            ranges[name] = float(low), float(high if colon else low)
        except ValueError:
            raise ValueError(f"range must read NAME=LOW:HIGH or NAME=VALUE; received {shown(text)}") from None
    return ranges


def parse_shard(text: str | None) -> tuple[int, int]:
    """Read `3/8`; the only share of one where there is no text."""
    number, _, total = ("1/1" if text is None else text).partition("/")
    try:
        return int(number), int(total)
    except ValueError:
        raise ValueError(f"shard must read i/n, e.g. 3/8; received {shown(text)}") from None


def read_design_file(path: str | Path) -> dict[str, Any]:
    """Read a TOML file with any of `design`, `count`, `seed`, `accuracy`, `modulus_ratio` and a table `ranges`.

    Raises:
        FileNotFoundError: no such file.
        ValueError: not TOML, or a key it does not know.
    """
    # Imported here because it loads NumPy.
    from bem._support.text_files import read_toml

    path = Path(path)
    if path.is_dir():
        raise ValueError(f"design file must be a file; received the folder {str(path)!r}")
    if not path.is_file():
        raise FileNotFoundError(f"design file not found; received {str(path)!r}")
    try:
        settings = read_toml(path)
    except ValueError as error:
        raise ValueError(f"design file must be TOML; received {str(path)!r} ({error})") from error
    keys = ("design", "count", "seed", "accuracy", "modulus_ratio", "ranges")
    unknown = sorted(set(settings) - set(keys))
    if unknown:
        raise ValueError(f"design file may hold {', '.join(keys)}; received {shown(unknown[0])} in {str(path)!r}")
    if not isinstance(settings.get("ranges", {}), dict):
        raise ValueError(f"ranges must be a table of NAME = [LOW, HIGH]; received {shown(settings['ranges'])}")
    return settings
