"""Fit all curves of one or more files, such as a force map: one line of a CSV a curve, and its picture.

The file is written line by line, so that an interrupted map goes on where it was. A curve that cannot be read or fitted
is a line with its reason.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bem._support.interruption import without_interrupts
from bem._support.tabular import labelled
from bem._support.text_files import read_text
from bem._support.validation import finite_number, instance
from bem.lab.curve import ForceCurve
from bem.lab.fitting import FitError, fit, guess_setup, require_options
from bem.lab.models import UNITS
from bem.lab.reading import RawCurve, raw_curves
from bem.lab.units import ForceSign, Quantity, require_sign, to_si
from bem.materials import Elastic, PronySeries

if TYPE_CHECKING:
    import xarray as xr

QUANTITIES = (
    *("relaxed_modulus", "modulus_at_1s", "work_of_adhesion", "retardation_time", "modulus_ratio", "exponent"),
    *("contact_point", "force_offset", "tilt", "drag"),
)
"""What a line holds beside the model, each with its interval."""
COLUMNS = (
    *("file", "number", "x", "y", "model", "adequate", "misfit", "reason"),
    *(f"{name}{end}" for name in QUANTITIES for end in ("", "_low", "_high")),
)

Row = dict[str, Any]
_ELASTIC = Elastic()


def fit_map(
    paths: Sequence[str | Path],
    out: str | Path,
    *,
    radius: Quantity,
    stiffness: Quantity | None = None,
    sensitivity: Quantity | None = None,
    speed: Quantity | None = None,
    force_sign: ForceSign = "tension",
    poisson_ratio: float = 0.5,
    half_angle: float | None = None,
    material: Elastic | PronySeries = _ELASTIC,
    jobs: int = 1,
    report: Callable[[int, int, int], None] | None = None,
    **options: Any,
) -> list[Row]:
    """Fit all curves of files.

    Args:
        paths: AFM files, or text files of one curve each.
        out: CSV of `COLUMNS`, in SI; lines that it holds already are kept.
        radius: of the sphere, in m.
        stiffness: of the cantilever, in N/m, in place of the files' own.
        sensitivity: of the deflection, in m/V, for files that hold volts.
        speed: of the stage, in m/s, for files without time.
        force_sign: which force text files count as positive.
        half_angle: of a cone or pyramid, in degrees.
        poisson_ratio, material: of the half-space; a `PronySeries`, whose times are in seconds, is held.
        jobs: processes.
        report: called with the numbers of curves done and failed, and of all.
        options: of `bem.lab.fit`, such as model and segment.

    Returns:
        the lines of the file, in its order; numbers are NaN where there is none.

    Raises:
        ValueError: an argument or option is invalid, or `out` belongs to other settings.
        FileNotFoundError: there is no such file.
    """
    from joblib import Parallel, cpu_count, delayed  # type: ignore[import-untyped]

    instance("material", material, (Elastic, PronySeries))
    require_sign(force_sign)
    require_options(half_angle, **{name: options[name] for name in options.keys() & {"model", "segment", "within"}})
    given = {"stiffness": stiffness, "sensitivity": sensitivity, "speed": speed}
    spring, volts, rate = (
        None if value is None else finite_number(name, to_si(name, value, name), above=0.0)
        for name, value in given.items()
    )
    known: dict[str, Any] = {"radius": finite_number("radius", to_si("radius", radius, "length"), above=0.0)}
    known["poisson_ratio"] = finite_number("poisson_ratio", poisson_ratio, low=0.0, high=0.5)
    known |= {} if isinstance(material, Elastic) else {"material": material}
    known |= {} if half_angle is None else {"half_angle": finite_number("half_angle", half_angle, above=0.0, high=89.0)}
    how = {"stiffness": spring, "speed": rate} | ({} if force_sign == "tension" else {"force_sign": force_sign})
    how |= {} if volts is None else {"sensitivity": volts}
    settings = json.dumps(known | how | options, sort_keys=True, default=str)
    out, head = Path(out), f"# {settings}\n{','.join(COLUMNS)}\n"
    # An interruption before the first curve leaves a part of the head.
    rows = read_map(out, settings) if out.exists() and not head.startswith(read_text(out)) else []
    done = {(row["file"], row["number"]) for row in rows}
    read = partial(_curves_of, stiffness=spring, force_sign=force_sign, sensitivity=volts)
    curves = ((str(path), *each) for path in paths for each in enumerate(read(Path(path))))
    left = [each for each in curves if each[:2] not in done]
    work = (delayed(_row)(*each, rate, known, options) for each in left)
    with without_interrupts():
        jobs = max(1, min(jobs, len(left), cpu_count()))
        fresh: Iterator[Row] = Parallel(n_jobs=jobs, return_as="generator")(work)
    if rows:  # a line that was cut short is written again
        content = out.read_bytes()
        out.write_bytes(content[: content.rfind(b"\n") + 1])
    with out.open("a" if rows else "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        if not rows:
            file.write(head)
        for row in fresh:
            writer.writerow(row)
            file.flush()
            rows.append(row)
            if report is not None:
                report(len(rows), sum(bool(each["reason"]) for each in rows), len(done) + len(left))
    return rows


def read_map(path: str | Path, settings: str | None = None) -> list[Row]:
    """The lines of a map's CSV; a last line that was cut short is left out.

    Raises:
        ValueError: the file is no map, or one of other settings.
    """
    text = read_text(path)
    lines = text[: text.rfind("\n") + 1].splitlines()
    if not lines or not lines[0].startswith("# ") or lines[1:2] != [",".join(COLUMNS)]:
        raise ValueError(f"Expected a map of `bem fit-map`; received {path}, which is none")
    if settings is not None and lines[0][2:] != settings:
        raise ValueError(f"the settings of {path} must be those of this map ({settings}); received {lines[0][2:]}")
    kinds: dict[str, Callable[[str], Any]] = dict.fromkeys(COLUMNS, lambda text: float(text or "nan"))
    kinds |= {"number": int} | dict.fromkeys(("file", "model", "adequate", "reason"), str)
    return [{name: kinds[name](text) for name, text in row.items()} for row in csv.DictReader(lines[1:])]


def _curves_of(path: Path, **how: Any) -> Sequence[RawCurve | str]:
    """The curves of a file, or the reason why it has none."""
    try:
        return raw_curves([path], columns={}, **how) or ["the file holds no curve"]
    except ValueError as error:
        return [str(error)]


def _row(path: str, number: int, curve: RawCurve | str, speed: float | None, known: Row, options: Row) -> Row:
    row: Row = dict.fromkeys(COLUMNS, np.nan)
    row |= {"file": path, "number": number, "model": "", "adequate": "", "reason": ""}
    if isinstance(curve, str):
        return row | {"reason": curve}
    row["x"], row["y"] = curve.position
    try:
        measured = ForceCurve(**curve.columns(path, speed))
        found = fit(measured, guess_setup(measured, **known), **options)
    except (ValueError, FitError) as error:
        return row | {"reason": str(error)}
    row |= {"model": found.model, "adequate": "yes" if found.adequate else "no", "misfit": found.misfit}
    for name in set(QUANTITIES) & found.values.keys():
        row[name], (row[f"{name}_low"], row[f"{name}_high"]) = found.values[name], found.intervals[name]
    return row


def to_xarray(rows: Sequence[Row]) -> xr.Dataset:
    """The lines as a data set over `curve`, with units; xarray is an option of the package."""
    variables = {name: ("curve", [row[name] for row in rows], UNITS.get(name, "")) for name in COLUMNS}
    return labelled(variables, {name: UNITS[name] for name in QUANTITIES if UNITS[name]})


def plot_map(rows: Sequence[Row], path: str | Path, quantity: str = "relaxed_modulus") -> None:
    """Draw a quantity over the position, or over the number where there is none.

    Curves that failed are crosses; those to which no model is adequate have a white dot.
    """
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure
    from matplotlib.ticker import EngFormatter, MaxNLocator

    from bem.plots import COLOURS, PULL_OFF

    places, values = np.array([(row["x"], row["y"]) for row in rows]), np.array([row[quantity] for row in rows])
    words, failed = quantity.replace("_", " "), ~np.isfinite(values)
    figure = Figure(figsize=(5.2, 4.2), layout="constrained")
    axes = figure.subplots()
    if np.isfinite(places).all() and len(np.unique(places, axis=0)) > 1:
        x, y = places.T
        known = values[~failed]
        norm = LogNorm() if known.size and 0.0 < 10.0 * known.min() < known.max() else None
        look: dict[str, Any] = {"marker": "s", "s": min(4e4 / len(rows), 200.0), "cmap": "viridis", "norm": norm}
        drawn = axes.scatter(x, y, c=values, plotnonfinite=False, **look)
        axes.set(aspect="equal", xlabel="x", ylabel="y")
        figure.colorbar(drawn, format=EngFormatter(UNITS[quantity]), label=words)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set(major_formatter=EngFormatter("m"), major_locator=MaxNLocator(4))
    else:
        lowest = 0.0 if failed.all() else float(np.nanmin(values))
        places = np.column_stack([np.arange(len(rows)), np.where(failed, lowest, values)])
        axes.plot(places[:, 0], values, "o", color=COLOURS["solver"])
        axes.set(xlabel="curve", ylabel=words)
        axes.locator_params(axis="x", integer=True)
        axes.yaxis.set_major_formatter(EngFormatter(UNITS[quantity]))
    doubtful = np.array([row["adequate"] == "no" for row in rows]) & ~failed
    for chosen, marker, label in ((failed, "x", "no fit"), (doubtful, ".", "no adequate model")):
        if chosen.any():
            inner, edge = (PULL_OFF, PULL_OFF) if chosen is failed else ("white", "0.4")
            axes.plot(*places[chosen].T, marker, label=label, color=inner, markeredgecolor=edge)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False)
    figure.savefig(path, dpi=150, bbox_inches="tight")
