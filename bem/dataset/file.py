"""The HDF5 file of a data set: written completely or not at all, and read only when its parts are consistent.

docs/dataset.md describes the groups of the file with their shapes, units and attributes.
"""

import json
from collections.abc import Mapping
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
from bem.dataset.checks import attribute_fault, column_fault
from bem.dataset.designs import QUANTITIES
from bem.dataset.hdf5_arrays import arrays
from bem.dataset.measurement_steps import grid_of
from bem.dataset.opening import FORMAT, FORMAT_VERSION, SEALED, DamagedFileError, open_dataset
from bem.dataset.records import COMPLETED, SCALARS, Columns
from bem.dataset.sealed_file import BLOCK, seal

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


def write_tree(target: BytesIO, columns: Columns, attributes: Mapping[str, Any], *, first_block: int = 0) -> None:
    """Write columns, with their units, and root attributes as HDF5; dictionaries and lists become JSON.

    The first block stays free.
    """
    with h5py.File(target, "w", userblock_size=first_block) as file:
        for name, value in attributes.items():
            file.attrs[name] = json.dumps(value) if isinstance(value, dict | list) else value
        for path, values in columns.items():
            if values.dtype == object:
                file.create_dataset(path, data=values, dtype=h5py.string_dtype(), chunks=None)
            elif values.nbytes > SMALL:
                options = {"compression": "gzip", "compression_opts": 6, "shuffle": True, "fletcher32": True}
                file.create_dataset(path, data=values, **options)
            else:
                file.create_dataset(path, data=values)
            file[path].attrs["units"] = UNITS.get(path.rpartition("/")[2], "")


def read_tree(file: h5py.File, *, native: bool = True) -> Columns:
    """Read all arrays of an open file by their path, with or without the native histories.

    Raises:
        ValueError: an array that holds neither numbers nor text, or that is not in the file itself.
    """
    columns: Columns = {}
    for path, item in arrays(file):
        text = h5py.check_string_dtype(item.dtype)
        if not text and item.dtype.kind not in "iuf":
            raise ValueError(f"/{path} holds neither numbers nor text")
        if native or not path.startswith("native/"):
            columns[path] = item.asstr()[:] if text else item[:]
    return columns


def write_dataset(
    path: Path,
    columns: Columns,
    attributes: Mapping[str, Any],
    counts: tuple[int, int, int],
    scratch: Path | None = None,
) -> None:
    """Write a data set to a temporary name and move it into place once it is on the disk.

    Args:
        path: where it goes.
        columns: arrays by their path in the file.
        attributes: root attributes.
        counts: measurement points of loading, dwell and unloading.
        scratch: folder of the temporary file, on the same file system; that of `path` by default.

    Raises:
        OSError: nothing was written, and what was at `path` is untouched.
    """
    # In memory first, because the HDF5 library crashes on a full disk.
    memory = BytesIO()
    kind = {"format": FORMAT, "format_version": FORMAT_VERSION, SEALED: 1}
    write_tree(memory, columns, kind | dict(attributes), first_block=BLOCK)
    with h5py.File(memory, "r+") as file:
        file["fms"].attrs["counts"] = np.array(counts, dtype=np.int64)
    seal(memory)
    write_whole(path, memory.getbuffer(), scratch)


def load_dataset(path: str | Path, *, native: bool = False) -> Dataset:
    """Read a data set, by default without native histories.

    Raises:
        FileNotFoundError: no such file.
        DamagedFileError: a `ValueError`; the file is damaged, or its parts are inconsistent.
        ValueError: as `open_dataset`.
    """
    with open_dataset(path) as file:
        try:
            columns = read_tree(file, native=native)
            counts = tuple(int(count) for count in file["fms"].attrs["counts"])
            attributes = {name: plain_attribute(value) for name, value in file.attrs.items()}
            wrong = attribute_fault(attributes) or column_fault(columns, attributes["campaign"], counts)
        except Exception as error:  # on a damaged file the library may raise any error
            wrong = f"which cannot be read ({shortened(str(error)) or type(error).__name__})"
    if wrong:
        raise DamagedFileError(f"expected a complete data set; received {str(path)!r}, {wrong}")
    loading, dwell, unloading = counts
    return Dataset(columns, attributes, (loading, dwell, unloading))


def plain_attribute(value: Any) -> Any:
    """An attribute of a file in the form in which `write_tree` received it."""
    if isinstance(value, str) and value.startswith(("{", "[")):
        return json.loads(value)
    return value.item() if isinstance(value, np.generic) else value
