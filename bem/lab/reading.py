"""Read measured force curves: text files of columns, and the formats of afmformats.

A column is a name and a unit: `force (nN)`, `force [nN]`, `force/nN` or `force_nN`; `bem.lab.exporters` has the names.
Approach and retract may be two files, or paired columns of one; then the second begins where the first ends.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from bem._support.validation import FloatArray
from bem._support.wording import shown
from bem.lab.afm_files import InstrumentError, load_afm
from bem.lab.exporters import EXPORTERS, FACTS, PARTS, column_of
from bem.lab.raw_curve import RawCurve, listed
from bem.lab.text_tables import NUMBER, table_of
from bem.lab.units import ForceSign, factor

_TEXT_FILES = (".csv", ".txt", ".tsv", ".dat", ".asc")
_POSITIONS = ("displacement", "height", "indentation", "separation")


def raw_curves(
    paths: Sequence[Path],
    stiffness: float | None,
    force_sign: ForceSign | None,
    columns: Mapping[str, str],
    sensitivity: float | None = None,
) -> tuple[list[RawCurve], ForceSign]:
    """All curves of an AFM file, or the one of text files, and the sign of their forces; see `ForceCurve.read`."""
    if len(paths) == 1 and paths[0].suffix.lower() not in _TEXT_FILES:
        return load_afm(paths[0], stiffness, sensitivity), force_sign or "compression"
    try:
        files = [_text_curve(path, columns, stiffness, sensitivity) for path in paths]
        tables = [raw.quantities for raw, _ in files]
        for path, table in zip(paths, tables, strict=True):
            if set(table) != set(tables[0]):
                raise ValueError(
                    f"the files of one curve must have the same columns; received {path} with {listed(table)}"
                )
    except ValueError as error:
        # Instruments write text of their own, which afmformats may know.
        try:
            if len(paths) == 1 and (curves := load_afm(paths[0], stiffness, sensitivity)):
                return curves, force_sign or "compression"
        except InstrumentError as afm_error:
            raise ValueError(f"{error}; as a file of an instrument: {afm_error}") from afm_error
        except ValueError:
            pass
        raise
    quantities, sign = _joined(tables), files[0][1]
    if force_sign is not None and force_sign != sign:
        quantities["force"] = -quantities["force"]
    return [replace(files[0][0], quantities=quantities)], force_sign or sign


def _joined(parts: Sequence[dict[str, FloatArray]]) -> dict[str, FloatArray]:
    """The columns of parts in a row; times that begin before the part ahead has ended are moved behind it."""
    for ahead, part in itertools.pairwise(parts):
        if "time" in part and part["time"][0] < (end := ahead["time"][-1]):
            steps = np.diff(part["time"])
            part["time"] = part["time"] - part["time"][0] + end + (float(np.median(steps)) if steps.size else 0.0)
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _text_curve(
    path: Path, renamed: Mapping[str, str], stiffness: float | None, sensitivity: float | None
) -> tuple[RawCurve, ForceSign]:
    """The curve of a text file, and the sign in which its force was written."""
    titles, units, rows, facts, dropped = table_of(path)
    exporter, parts = _named([renamed.get(title.strip(), title) for title in titles], units, rows, path)
    spring, volts = (_fact(facts, name) for name in ("stiffness", "sensitivity"))
    sign: ForceSign = "tension" if "tension" in parts[0] else "compression"
    for table in parts:
        if "deflection_in_volts" in table:
            if (per_volt := sensitivity or volts) is None:
                raise ValueError(f"sensitivity (m/V; --sensitivity) must be given for volts; received {path} without")
            table["deflection"] = table.pop("deflection_in_volts") * per_volt
        elif sensitivity is not None:
            raise ValueError(f"sensitivity turns volts into a force; received {path}, which has no volts")
        if "force" not in table and "tension" not in table:
            if "deflection" not in table or (constant := stiffness or spring) is None:
                needed = "a column force, such as 'force (nN)', or a deflection and the spring constant (--stiffness)"
                raise ValueError(f"a force curve must have {needed}; received {path} with {shown(titles)}")
            table["force"] = table["deflection"] * constant
        elif stiffness and spring:
            name = "force" if "force" in table else "tension"
            table[name] = table[name] * (stiffness / spring)
        table.pop("deflection", None)
        if sign == "tension":
            table["force"] = -table.pop("tension")
    if "z" in parts[0]:  # the larger half of the forces lies where the sphere is pressed in
        z, strength = parts[0]["z"], np.abs(parts[0]["force"] - np.median(parts[0]["force"]))
        towards = z[strength > 0.5 * strength.max()].mean() > z.mean()
        for table in parts:
            table["displacement"] = table.pop("z") * (1.0 if towards else -1.0)
    position = next((name for name in _POSITIONS if name in parts[0]), None)
    if len(parts) > 1 and position and "time" not in parts[1]:
        turn, (begin, end) = parts[0][position][-1], parts[1][position][[0, -1]]
        if abs(begin - turn) > abs(end - turn):  # a retraction that is stored from its far end on
            parts[1] = {name: values[::-1] for name, values in parts[1].items()}
    quantities = _joined(parts)
    if quantities["force"].size < 2:
        raise ValueError(f"a file must have a header and at least two rows of numbers; received {path}")
    notes = [f"Columns of {exporter}: {listed(quantities)}."]
    notes += [f"{dropped} rows without numbers were left out."] if dropped else []
    used = stiffness or (spring if "displacement" in quantities or "height" in quantities else None)
    return RawCurve(quantities, used, notes=tuple(notes)), sign


def _fact(facts: Mapping[str, str], name: str) -> float | None:
    """A number of the lines before the table; `None` where there is none."""
    for title in FACTS[name]:
        match = NUMBER.match(facts.get(title.lower(), "").replace(",", "."))
        if match and float(match[0]) > 0.0:
            return float(match[0]) * (1e-9 if "nm/v" in title.lower() else 1.0)
    return None


def _named(
    titles: Sequence[str], units: Sequence[str], rows: FloatArray, path: Path
) -> tuple[str, list[dict[str, FloatArray]]]:
    """The exporter that knows most titles, and the columns in SI, of one part or of approach and retraction."""
    parsed = [column_of(title) for title in titles]
    matches = {exporter: [name in table for name, _, _ in parsed].count(True) for exporter, table in EXPORTERS.items()}
    exporter = max(EXPORTERS, key=lambda title: (matches[title], title == "generic"))
    table = EXPORTERS["generic"] | EXPORTERS[exporter]
    parts: dict[str, dict[str, FloatArray]] = {}
    for number, (name, unit, segment) in enumerate(parsed):
        quantity, usual = table.get(name, ("", ""))
        unit = unit or (units[number] if number < len(units) else "") or usual
        columns = parts.setdefault(segment, {}) if quantity else {}
        if not quantity or (quantity in columns and exporter != "generic"):
            continue
        title = f"column {shown(titles[number])} of {path}"
        if quantity in columns:
            raise ValueError(f"a file must have one column {quantity}; received several in {path}")
        if not unit:
            raise ValueError(f"a column must name its unit, such as 'force (nN)'; received {title}")
        if quantity in ("deflection", "force") and unit == "V":
            columns["deflection_in_volts"] = rows[:, number]
            continue
        dimension = {"time": "time", "force": "force", "tension": "force"}.get(quantity, "length")
        columns[quantity] = factor(title, unit, dimension) * rows[:, number]
    ordered = [parts[segment] for segment in ("", *PARTS) if segment in parts]
    if not any(ordered):
        raise ValueError(
            f"a force curve must have a column force, such as 'force (nN)'; received {path} with no column of a known "
            f"name: {shown(titles)}"
        )
    if len(ordered) > 1 and "" in parts:  # columns that both parts share, such as a place
        ordered = [parts[""] | segment for segment in ordered[1:]]
    # Paired columns of unequal length are filled up with nothing.
    finite = [np.all([np.isfinite(values) for values in segment.values()], axis=0) for segment in ordered]
    return exporter, [
        {name: values[keep] for name, values in segment.items()} for segment, keep in zip(ordered, finite, strict=True)
    ]
