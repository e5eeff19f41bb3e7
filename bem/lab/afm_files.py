"""Read the formats of atomic force microscopes through the optional package afmformats."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bem._support.validation import FloatArray
from bem._support.wording import shown
from bem.lab.units import INSTALL

if TYPE_CHECKING:
    from bem.lab.curve import ForceSign


def read_afm(path: Path, stiffness: float | None) -> tuple[dict[str, FloatArray], float | None, ForceSign]:
    """Read the first force curve of an AFM file.

    afmformats gives SI units, compression positive, and a height or tip position that grows away from the sample. The
    file's own spring constant is used where none is given.

    Returns:
        the quantities by the names of `bem.lab.reading`, the stiffness in N/m, and the sign of the force.

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
    try:
        curves = afmformats.load_data(path)
        curve = curves[0]
        names = list(curve.columns)
    # Its own errors are no `Exception`, and each of its readers raises others.
    except (Exception, afmformats.errors.AFMFileFormatError, afmformats.errors.MissingMetaDataError) as error:
        raise ValueError(
            f"Expected a CSV or an AFM file that afmformats reads; received {path} ({shown(str(error))})"
        ) from error
    if "force" not in names:
        raise ValueError(f"Expected an AFM file with force; received {path} with {sorted(names)}")
    quantities = {"force": _floats(curve, "force")}
    if "time" in names:
        quantities["time"] = _floats(curve, "time")
    heights = [name for name in ("height (measured)", "height (piezo)") if name in names]
    spring = stiffness if stiffness is not None else float(curve.metadata.get("spring constant", np.nan))
    if heights:
        quantities["height"] = _floats(curve, heights[0])
    if not heights or not np.isfinite(spring):
        if "tip position" not in names:
            raise ValueError(f"Expected an AFM file with height and spring constant, or tip position; received {path}")
        quantities["indentation"] = -_floats(curve, "tip position")
    return quantities, spring if "indentation" not in quantities else None, "compression"


def _floats(curve: Any, name: str) -> FloatArray:
    return np.asarray(curve[name], dtype=np.float64)
