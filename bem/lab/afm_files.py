"""Read the formats of afmformats."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import Any
from zipfile import ZipFile, is_zipfile

import numpy as np

from bem._support.validation import FloatArray
from bem._support.wording import shown
from bem.lab.raw_curve import RawCurve
from bem.lab.text_tables import require_file

INSTALL = "`pip install '.[lab]'` in a clone of the repository"

_MOST_BYTES = 2**31  # of an AFM file, unpacked: most formats are archives
_HEIGHTS = ("height (measured)", "height (piezo)")


class InstrumentError(ValueError):
    """A file that afmformats knows lacks something of a force curve."""


def load_afm(path: str | Path, stiffness: float | None = None, sensitivity: float | None = None) -> list[RawCurve]:
    """Read all force curves of an AFM file.

    afmformats gives SI units, compression positive, and a height or tip position that grows away from the sample. A
    given spring constant (N/m) or sensitivity (m/V) replaces the file's own, and the force changes with it.

    Raises:
        ValueError: afmformats is not installed, or the file is not one it reads.
        FileNotFoundError: there is no such file.
    """
    path = Path(path)
    require_file(path, "a text or an AFM file")
    try:
        import afmformats
    except ImportError as error:
        raise ValueError(
            f"files such as {path} need afmformats, from {INSTALL}; received a file that is no CSV"
        ) from error
    # The library logs whole tracebacks, which Python prints to the terminal where nobody handles them.
    logging.getLogger("afmformats").addHandler(logging.NullHandler())
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with ZipFile(path) if is_zipfile(path) else nullcontext() as archive:
                size = sum(member.file_size for member in archive.infolist()) if archive else path.stat().st_size
            if size > _MOST_BYTES:
                raise ValueError(f"{size} bytes, more than {_MOST_BYTES}")
            values = {"spring constant": stiffness, "sensitivity": sensitivity}
            overrides = {name: value for name, value in values.items() if value is not None}
            try:
                curves = afmformats.load_data(path, meta_override=dict(overrides))
            except NotImplementedError:  # some of its readers take none
                curves = afmformats.load_data(path)
            return [_converted(curve, overrides, path) for curve in curves]
    except InstrumentError:
        raise
    # Its own errors are no `Exception`, and each of its readers raises others.
    except afmformats.errors.MissingMetaDataError as error:
        raise InstrumentError(
            f"the AFM file must have its metadata, or --stiffness in N/m and --sensitivity in m/V must be given; "
            f"received {path} ({shown(str(error))})"
        ) from error
    except (Exception, afmformats.errors.AFMFileFormatError) as error:
        raise ValueError(
            f"a measured curve must be a CSV or an AFM file that afmformats reads; received {path} "
            f"({shown(str(error))})"
        ) from error


def _converted(curve: Any, overrides: Mapping[str, float], path: Path) -> RawCurve:
    names = ("force", "time", *_HEIGHTS, "tip position")
    columns = {name: np.asarray(curve[name], dtype=np.float64) for name in names if name in curve.columns}
    if "force" not in columns:
        raise InstrumentError(f"the AFM file must have a force; received {path} with {sorted(columns)}")
    spring, speed = (float(curve.metadata.get(name) or np.nan) for name in ("spring constant", "speed approach"))
    spring = overrides.get("spring constant", spring)
    for name, value in overrides.items():
        columns["force"] = columns["force"] * (value / float(curve.metadata.get(name) or value))
    quantities: dict[str, FloatArray] = {name: columns[name] for name in ("force", "time") if name in columns}
    heights = [columns[name] for name in _HEIGHTS if name in columns]
    if heights and np.isfinite(spring):
        quantities["height"] = heights[0]
    elif "tip position" in columns:
        quantities["indentation"] = -columns["tip position"]
    else:
        raise InstrumentError(
            f"the AFM file must have height and spring constant, or tip position; received {path}; stiffness gives "
            "the spring constant"
        )
    x, y = (float(curve.metadata.get(f"position {axis}", np.nan)) for axis in "xy")
    spring_used, speed_known = spring if "height" in quantities else None, speed if np.isfinite(speed) else None
    return RawCurve(quantities, spring_used, speed_known, (x, y), ("Read by afmformats; compression positive.",))
