"""The HDF5 file of a data set: written completely or not at all, and read only when its parts are consistent.

docs/dataset.md describes the groups of the file with their shapes, units and attributes.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from bem._support.outputs import write_whole
from bem._support.quantities import UNITS
from bem._support.validation import FloatArray
from bem._support.wording import shortened
from bem.dataset.checks import check_attributes, check_dataset
from bem.dataset.designs import QUANTITIES
from bem.dataset.records import COMPLETED, SCALARS, Columns, grid_of
from bem.dataset.sealed_file import BLOCK, FORMAT, FORMAT_VERSION, SEALED, DamagedFileError, arrays, open_dataset, seal

SUFFIXES = (".h5", ".hdf5")
"""Suffixes of a data set file."""
SMALL = 4096
"""Size in bytes above which an array is compressed."""


@dataclass(frozen=True, eq=False)
class Dataset:
    """The contents of a data set file; native histories only where they were asked for.

    Args:
        columns: arrays by their path in the file.
        attributes: the root attributes; those that the file stores as JSON text are objects here.
        counts: measurement points of loading, dwell and unloading.
    """

    columns: Columns
    attributes: dict[str, Any]
    counts: tuple[int, int, int]

    def __len__(self) -> int:
        return len(self.columns["index"])

    @property
    def protocols(self) -> dict[str, FloatArray]:
        """The five quantities by name, each of shape (n,)."""
        return {name: self.columns[f"protocols/{name}"] for name in QUANTITIES}

    @property
    def modulus_ratios(self) -> FloatArray:
        """Modulus ratio of each trajectory's solid, shape (n,)."""
        one = self.attributes["campaign"]["modulus_ratio"]
        stored = self.columns.get("protocols/modulus_ratio")
        return np.full(len(self), float(one)) if stored is None else stored

    @property
    def steps(self) -> str:
        """How the measurement steps are placed: 'uniform' or 'physical'."""
        return self.attributes["campaign"].get("steps", "uniform")

    @property
    def scalars(self) -> dict[str, NDArray[Any]]:
        """Results and cost by name, each of shape (n,)."""
        return {name: self.columns[f"scalars/{name}"] for name in SCALARS}

    @property
    def force(self) -> NDArray[np.float32]:
        """Force on the measurement grid, shape (n, N)."""
        return self.columns["fms/force"]

    @property
    def completed(self) -> NDArray[np.intp]:
        """Rows of the trajectories that completed."""
        return np.flatnonzero(self.columns["status"] == COMPLETED)

    def grid(self) -> tuple[FloatArray, FloatArray]:
        """Measurement instants and indentations, each of shape (n, N)."""
        return grid_of(self.steps, self.protocols, self.modulus_ratios, self.counts)


def write_file(
    path: Path, columns: Columns, attributes: Mapping[str, Any], scratch: Path | None = None, *, form: str = FORMAT
) -> None:
    """Write a sealed file to a temporary name and move it into place once it is on the disk.

    Args:
        path: where it goes.
        columns: arrays by their path in the file; each gets its unit as an attribute.
        attributes: root attributes; dictionaries and lists become JSON.
        scratch: the temporary name, on the same file system; a new one beside `path` by default.
        form: name of the format, whose version is 1.

    Raises:
        OSError: nothing was written, and what was at `path` is untouched.
    """
    # In memory first, because the HDF5 library crashes on a full disk.
    memory = BytesIO()
    kind = {"format": form, "format_version": FORMAT_VERSION, SEALED: 1}
    with h5py.File(memory, "w", userblock_size=BLOCK) as file:
        for name, value in (kind | dict(attributes)).items():
            file.attrs[name] = json.dumps(value) if isinstance(value, dict | list) else value
        for name, values in columns.items():
            options: dict[str, Any] = {}
            if values.dtype == object:
                options = {"dtype": h5py.string_dtype()}
            elif values.nbytes > SMALL:
                options = {"compression": "gzip", "compression_opts": 6, "shuffle": True, "fletcher32": True}
            file.create_dataset(name, data=values, **options).attrs["units"] = UNITS.get(name.rpartition("/")[2], "")
        if "fms" in file:
            file["fms"].attrs["counts"] = np.array(attributes["campaign"]["counts"], dtype=np.int64)
    seal(memory)
    write_whole(path, memory.getbuffer(), scratch)


def read_file(
    path: Path,
    build: Callable[[Columns, dict[str, Any], h5py.File], Any],
    *,
    form: str = FORMAT,
    what: str = "data set",
    native: bool = True,
) -> Any:
    """Read a sealed file: what `build` makes of its arrays, root attributes and the open file.

    Args:
        path: the file.
        build: raises `DamagedFileError`, or any error, where the parts do not fit together.
        form: name of the format.
        what: what the file should hold, for the message.
        native: whether to read the native histories too.

    Returns:
        what `build` returned.

    Raises:
        FileNotFoundError: no such file.
        DamagedFileError: a `ValueError`; the file is damaged, or its parts are inconsistent.
        ValueError: as `open_dataset`.
    """
    with open_dataset(path, form) as file:
        try:
            columns: Columns = {}
            for name, item in arrays(file):
                text = h5py.check_string_dtype(item.dtype)
                if not text and item.dtype.kind not in "iuf":
                    raise ValueError(f"/{name} holds neither numbers nor text")
                if native or not name.startswith("native/"):
                    columns[name] = item.asstr()[:] if text else item[:]
            # Read first, interpreted later: an iteration that an error cuts short keeps h5py's lock in its traceback.
            stored = dict(file.attrs.items())
            return build(columns, {name: _plain(value) for name, value in stored.items()}, file)
        except Exception as error:  # on a damaged file the library may raise any error
            wrong = f"which cannot be read ({shortened(str(error)) or type(error).__name__})"
            wrong = str(error) if isinstance(error, DamagedFileError) else wrong
            raise DamagedFileError(f"expected a complete {what}; received {str(path)!r}, {wrong}") from error


def load_dataset(path: str | Path, *, native: bool = False) -> Dataset:
    """Read a data set, by default without native histories.

    Raises:
        FileNotFoundError: no such file.
        DamagedFileError: a `ValueError`; the file is damaged, or its parts are inconsistent.
        ValueError: as `open_dataset`.
    """
    return read_file(Path(path), _dataset, native=native)


def _dataset(columns: Columns, attributes: dict[str, Any], file: h5py.File) -> Dataset:
    counts = tuple(int(count) for count in file["fms"].attrs["counts"])
    check_attributes(attributes)
    check_dataset(columns, attributes["campaign"], counts)
    return Dataset(columns, attributes, counts)  # type: ignore[arg-type]


def _plain(value: Any) -> Any:
    """An attribute of a file in the form in which `write_file` received it."""
    if isinstance(value, str) and value.startswith(("{", "[")):
        return json.loads(value)
    return value.item() if isinstance(value, np.generic) else value
