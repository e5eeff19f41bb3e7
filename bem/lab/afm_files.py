"""Read the formats of atomic force microscopes through the optional package afmformats."""

from __future__ import annotations

import logging
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import ZipFile, is_zipfile

import numpy as np

from bem._support.validation import FloatArray
from bem._support.wording import shown

INSTALL = "pip install 'contact-trajectories[lab]'"
_MOST_BYTES = 2**31  # unpacked: most formats are archives
_FACTS = ("spring constant", "speed approach")
_COLUMNS = ("force", "time", "height (measured)", "height (piezo)", "tip position")


@dataclass(frozen=True)
class AfmCurve:
    """One curve of a file."""

    quantities: dict[str, FloatArray]
    """By the names of `bem.lab.reading`, in SI, compression positive."""
    stiffness: float | None
    """In N/m; `None` where the indentation needs none."""
    speed: float | None
    """In m/s, for a curve without time."""
    position: tuple[float, float]
    """Of the curve in a map, in m; NaN where the file has none."""


def load_afm(path: Path, stiffness: float | None) -> list[AfmCurve]:
    """Read all force curves of an AFM file.

    afmformats gives SI units, compression positive, and a height or tip position that grows away from the sample. A
    given spring constant replaces the file's own.

    Raises:
        ValueError: afmformats is not installed, or the file is not one it reads.
        FileNotFoundError: there is no such file.
    """
    if not path.exists():
        raise FileNotFoundError(2, "No such file or directory", str(path))
    if path.is_dir():
        raise ValueError(f"Expected a CSV or an AFM file; received {path}, which is a directory")
    try:
        import afmformats
    except ImportError as error:
        raise ValueError(f"files such as {path} need afmformats ({INSTALL}); received a file that is no CSV") from error
    # The library logs whole tracebacks, which Python prints to the terminal where nobody handles them.
    logging.getLogger("afmformats").addHandler(logging.NullHandler())
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            _check_size(path)
            override = {} if stiffness is None else {"spring constant": stiffness}
            return [_converted(curve, stiffness, path) for curve in afmformats.load_data(path, meta_override=override)]
    # Its own errors are no `Exception`, and each of its readers raises others.
    except (Exception, afmformats.errors.AFMFileFormatError, afmformats.errors.MissingMetaDataError) as error:
        if str(error).startswith("Expected an AFM file"):
            raise
        raise ValueError(
            f"Expected a CSV or an AFM file that afmformats reads; received {path} ({shown(str(error))})"
        ) from error


def _converted(curve: Any, stiffness: float | None, path: Path) -> AfmCurve:
    found = {name: np.asarray(curve[name], dtype=np.float64) for name in _COLUMNS if name in curve.columns}
    if "force" not in found:
        raise ValueError(f"Expected an AFM file with force; received {path} with {sorted(found)}")
    facts = {name: float(curve.metadata.get(name) or np.nan) for name in _FACTS}
    spring = facts["spring constant"] if stiffness is None else stiffness
    quantities: dict[str, FloatArray] = {name: found[name] for name in ("force", "time") if name in found}
    heights = [found[name] for name in ("height (measured)", "height (piezo)") if name in found]
    if heights and np.isfinite(spring):
        quantities["height"] = heights[0]
    elif "tip position" in found:
        quantities["indentation"] = -found["tip position"]
    else:
        raise ValueError(
            f"Expected an AFM file with height and spring constant, or tip position; received {path}; stiffness gives "
            "the spring constant"
        )
    position = tuple(float(curve.metadata.get(f"position {axis}", np.nan)) for axis in "xy")
    speed = facts["speed approach"] if np.isfinite(facts["speed approach"]) else None
    return AfmCurve(quantities, spring if "height" in quantities else None, speed, (position[0], position[1]))


def _check_size(path: Path) -> None:
    size = path.stat().st_size
    if is_zipfile(path):
        with ZipFile(path) as archive:
            size = sum(part.file_size for part in archive.infolist())
    if size > _MOST_BYTES:
        raise ValueError(f"{size} bytes, more than {_MOST_BYTES}")
