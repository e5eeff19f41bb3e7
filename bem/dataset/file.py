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
from bem._support.tabular import UNITS
from bem._support.validation import FloatArray
from bem._support.wording import shortened, shown
from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import STEPS
from bem.dataset.records import COMPLETED, FAILED, SCALARS, SOLIDS, Columns, Layout, grid_of, measured_layout
from bem.dataset.sealed_file import BLOCK, FORMAT, FORMAT_VERSION, SEALED, DamagedFileError, arrays, open_dataset, seal
from bem.dataset.solids import Solids

SUFFIXES = (".h5", ".hdf5")
"""Suffixes of a data set file."""
SMALL = 4096
"""Size in bytes above which an array is compressed."""
ATTRIBUTES = {
    "campaign": dict,
    "versions": dict | list,
    "host": str | list,
    "accuracy": str | float | int,
    "wall_seconds": float | int,
    "core_seconds": float | int,
    "workers": int,
}
"""Root attributes that every reader needs, and their types."""
IDENTITY = ("design", "ranges", "modulus_ratio", "seed", "count", "accuracy", "counts", "native", "shard", "solver")
"""What the attribute `campaign` of a data set holds."""
_RATES = ("protocols/tabor", "protocols/loading_rate", "protocols/unloading_rate")
RULES: dict[str, tuple[Callable[..., Any], str]] = {
    "status": (lambda values: np.isin(values, (COMPLETED, FAILED)), "neither completed nor failed"),
    **dict.fromkeys(("jumps", "native", "protocols", "solids"), (np.isfinite, "not finite")),
    **dict.fromkeys(_RATES, (lambda values: values > 0.0, "not above zero")),
    "protocols/dwell_time": (lambda values: values >= 0.0, "not zero or above"),
    "solids/strengths": (lambda values: values >= 0.0, "not zero or above"),
    "solids/times": (lambda values: values > 0.0, "not above zero"),
    "protocols/modulus_ratio": (lambda values: (values > 0.0) & (values <= 1.0), "not above 0 and at most 1"),
}
"""What holds for all values of an array or a group, and what they are where it does not."""


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
        ratio = self.attributes["campaign"]["modulus_ratio"]
        stored = self.columns.get("protocols/modulus_ratio")
        return np.full(len(self), float(ratio)) if stored is None else stored

    @property
    def solids(self) -> tuple[FloatArray, FloatArray]:
        """Retardation strengths and times of each trajectory's solid, (n, m) each; unused terms are 0 and 1."""
        if SOLIDS[0] in self.columns:
            return self.columns[SOLIDS[0]], self.columns[SOLIDS[1]]
        return 1.0 - self.modulus_ratios[:, np.newaxis], np.ones((len(self), 1))

    @property
    def steps(self) -> str:
        """How the measurement steps are placed: one of `STEPS`."""
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
        around = dict(zip(("strengths", "retardation_times"), self.solids, strict=True))
        around |= {"pull_off_time": self.scalars["pull_off_time"]}
        return grid_of(self.steps, self.protocols, self.counts, around)


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
    header = {"format": form, "format_version": FORMAT_VERSION, SEALED: 1}
    with h5py.File(memory, "w", userblock_size=BLOCK) as file:
        for name, value in (header | dict(attributes)).items():
            file.attrs[name] = json.dumps(value) if isinstance(value, dict | list) else value
        for name, values in columns.items():
            options: dict[str, Any] = {}
            if values.dtype == object:
                options = {"dtype": h5py.string_dtype()}
            elif values.nbytes > SMALL:
                options = {"compression": "gzip", "compression_opts": 6, "shuffle": True}
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
    label: str = "data set",
    native: bool = True,
) -> Any:
    """Read a sealed file: what `build` makes of its arrays, root attributes and the open file.

    Args:
        path: the file.
        build: raises `DamagedFileError`, or any error, where the parts do not fit together.
        form: name of the format.
        label: what the file should hold, for the message.
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
            raise DamagedFileError(f"expected a complete {label}; received {str(path)!r}, {wrong}") from error


def load_dataset(path: str | Path, *, native: bool = False) -> Dataset:
    """Read a data set, by default without native histories.

    Raises:
        FileNotFoundError: no such file.
        DamagedFileError: a `ValueError`; the file is damaged, or its parts are inconsistent.
        ValueError: as `open_dataset`.
    """
    return read_file(Path(path), _dataset, native=native)


def _plain(value: Any) -> Any:
    """An attribute of a file in the form in which `write_file` received it."""
    if isinstance(value, str) and value.startswith(("{", "[")):
        return json.loads(value)
    return value.item() if isinstance(value, np.generic) else value


def refuse(wrong: Any, fault: str) -> None:
    """Refuse a file that is `wrong`, an array of truth values or one, for a fault, which follows its name."""
    if np.any(wrong):
        raise DamagedFileError(fault)


def check_attributes(attributes: Mapping[str, Any], identity: tuple[str, ...] = IDENTITY) -> None:
    """Check the root attributes of a file, and that `campaign` holds the names of an `identity`.

    Raises:
        DamagedFileError: as all functions here, naming the attribute or the array.
    """
    for name, cls in ATTRIBUTES.items():
        refuse(name not in attributes, f"without the attribute {name!r}")
        refuse(not isinstance(attributes[name], cls), f"whose attribute {name!r} is {shown(attributes[name])}")
    campaign = attributes["campaign"]
    for name in identity:
        refuse(name not in campaign, f"whose attribute 'campaign' lacks {name!r}")
        stated, expected = attributes.get(name, campaign[name]), campaign[name]
        refuse(stated != expected, f"whose attribute {name!r} is {shown(stated)}, and {shown(expected)} in 'campaign'")


def check_columns(columns: Columns, layout: Layout, count: int) -> None:
    """Check the arrays of a file of a campaign of `count` trajectories."""
    size, jumps, instants = len(columns.get("index", ())), len(columns.get("jumps/trajectory", ())), 0
    groups = {path.partition("/")[0] for path in layout}
    refuse("index" not in columns, "without /index")
    if "jumps" in groups:
        _check_array(columns, "jumps/trajectory", "iu", (jumps,))
    if "native" in groups:
        _check_array(columns, "native/offsets", "iu", (size + 1,))
        instants = int(columns["native/offsets"][-1])
    for path, dtype in layout.items():
        rows = {"jumps": jumps, "native": instants}.get(path.partition("/")[0], size)
        _check_array(columns, path, {"O": "O", "f": "iuf"}.get(dtype.base.kind, "iu"), (rows, *dtype.shape))
    index = columns["index"].astype(np.int64)
    refuse(size == 0, "without trajectories")
    outside = index[0] < 0 or index[-1] >= count
    refuse(outside or np.any(np.diff(index) <= 0), f"whose /index does not increase from 0 to less than {shown(count)}")
    owners = columns.get("jumps/trajectory", index).astype(np.int64)
    foreign = np.any(np.diff(owners) < 0) or not np.all(np.isin(owners, index))
    refuse(foreign, "whose /jumps/trajectory is not in the order of /index")
    offsets = columns.get("native/offsets", np.zeros(1)).astype(np.int64)
    refuse(offsets[0] != 0 or np.any(np.diff(offsets) < 0), "whose /native/offsets do not increase from 0")
    for name in columns:
        for holds, fault in (RULES[key] for key in (name.partition("/")[0], name) if key in RULES):
            refuse(~holds(columns[name]), f"whose /{name} is {fault}")


def _check_array(columns: Columns, name: str, kinds: str, shape: tuple[int, ...]) -> None:
    """Check kind of dtype and shape of an array."""
    refuse(name not in columns, f"without /{name}")
    values = columns[name]
    wrong = values.dtype.kind not in kinds or values.shape != shape
    refuse(wrong, f"whose /{name} is {values.dtype} of shape {values.shape} instead of shape {shape}")


def _dataset(columns: Columns, attributes: dict[str, Any], file: h5py.File) -> Dataset:
    """Check a data set; native histories only where they were read."""
    check_attributes(attributes)
    identity, counts = attributes["campaign"], file["fms"].attrs["counts"].tolist()
    expected = identity["counts"]
    refuse(counts != expected, f"whose measurement points are {shown(counts)} instead of {shown(expected)}")
    steps = identity.get("steps", "uniform")
    refuse(steps not in STEPS, f"whose measurement steps are {shown(steps)}")
    drawn = [*QUANTITIES, *(["modulus_ratio"] if isinstance(identity["modulus_ratio"], list) else [])]
    layout = measured_layout(sum(counts), native=any(name.startswith("native/") for name in columns))
    protocols: dict[str, np.dtype] = {f"protocols/{name}": np.dtype(np.float64) for name in drawn}
    if "solids" in identity:
        terms: np.dtype = np.dtype((np.float64, (Solids.of(identity["solids"]).terms[1],)))
        protocols |= dict.fromkeys(SOLIDS, terms)
    check_columns(columns, {**layout, **protocols}, identity["count"])
    completed = columns["status"] == COMPLETED
    for name in ("fms/force", *(f"scalars/{name}" for name in SCALARS)):
        refuse(~np.isfinite(columns[name][completed]), f"whose /{name} is not finite in every completed trajectory")
    loading, dwell, unloading = counts
    return Dataset(columns, attributes, (loading, dwell, unloading))
