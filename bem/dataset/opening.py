"""Open data set files, after a check that their bytes are those that were written.

Files carry a seal (`bem.dataset.sealed_file`). The earliest files do not: they have HDF5's own checksums, and a
manifest beside such a file states its SHA-256 sum.
"""

import json
import mmap
import re
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import file_digest
from pathlib import Path
from typing import BinaryIO

import h5py
import numpy as np

from bem._support.wording import shown
from bem.dataset.sealed_file import BLOCK, is_intact, is_sealed

FORMAT = "viscoelastic-contact-dataset"
FORMAT_VERSION = 1
SEALED = "sealed"
"""Root attribute of sealed files; it reveals a file that has lost its first block."""
_HDF5 = b"\x89HDF\r\n\x1a\n"


class DamagedFileError(ValueError):
    """A file that is, or was, a data set cannot be read as one."""


@contextmanager
def open_dataset(path: str | Path, form: str = FORMAT, version: int = FORMAT_VERSION) -> Iterator[h5py.File]:
    """Open a data set, or another sealed file of this `form` and `version`, for reading.

    Raises:
        FileNotFoundError: no such file.
        DamagedFileError: a `ValueError`; truncated or altered since it was written.
        ValueError: not a data set, or of another version of the format.
    """
    path = Path(path)
    if path.is_dir():
        raise ValueError(f"expected a data set file; received the folder {str(path)!r}")
    if not path.is_file():
        raise FileNotFoundError(f"data set file not found; received {str(path)!r}")
    received = f"expected a data set of format {form!r}, version {version}; received {str(path)!r}"
    damaged = DamagedFileError(f"{received}, which is truncated or damaged")
    try:
        with path.open("rb") as content:
            sealed = is_sealed(content)
            if not sealed and not _is_hdf5(content):
                raise ValueError(f"{received}, which is not HDF5, or damaged at its beginning")
            intact = is_intact(content) if sealed else _may_be_opened(content, path)
            if not intact and _is_written_to(content, BLOCK if sealed else 0):
                raise ValueError(f"{received}, which another program is writing or has not finished")
    except PermissionError as error:
        raise ValueError(f"{received}, which may not be read") from error
    if not intact:
        raise damaged
    try:
        file = h5py.File(path, "r")
    except BlockingIOError as error:  # another program holds the lock that the HDF5 library takes on what it writes
        raise ValueError(f"{received}, which another program is writing") from error
    except Exception as error:  # on a damaged file the library may raise any error
        raise damaged from error
    with file:
        try:
            found, number = file.attrs.get("format"), file.attrs.get("format_version")
            lost = not sealed and SEALED in file.attrs
        except Exception as error:
            raise damaged from error
        if not isinstance(found, str) or found != form:
            raise ValueError(f"{received}, an HDF5 file of another kind")
        if not isinstance(number, np.integer) or number != version:
            number = number.item() if isinstance(number, np.generic) else number
            raise ValueError(f"{received}, which is of version {shown(number)}")
        if lost:
            raise damaged
        yield file


def _is_written_to(content: BinaryIO, first_block: int) -> bool:
    """Whether the HDF5 library has marked a file as open for writing, in the superblock behind a free first block."""
    content.seek(first_block)
    superblock = content.read(24)
    return superblock.startswith(_HDF5) and len(superblock) == 24 and superblock[20 if superblock[8] < 2 else 11] == 1


def _is_hdf5(content: BinaryIO) -> bool:
    """Whether a file begins with the signature of HDF5; a file cut within the signature counts too."""
    content.seek(0)
    return _HDF5.startswith(content.read(len(_HDF5)))


def _may_be_opened(content: BinaryIO, path: Path) -> bool:
    """Whether a file without a seal has the sum of its manifest or, without one, does not hang the HDF5 library."""
    published = _published_sum(path)
    if published is not None:
        content.seek(0)
        return file_digest(content, "sha256").hexdigest() == published
    return not _hangs(content)


def _published_sum(path: Path) -> str | None:
    """The SHA-256 sum that a manifest beside a file states for it; `None` where there is none."""
    try:
        entries = json.loads(path.with_name("MANIFEST.json").read_text(encoding="utf-8"))["files"]
        return entries[path.name]["sha256"]
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        return None


def _hangs(content: BinaryIO) -> bool:
    """Whether a global heap, where HDF5 keeps text, has an object of size zero, at which the library loops for ever."""
    with mmap.mmap(content.fileno(), 0, access=mmap.ACCESS_READ) as image:
        for heap in re.finditer(rb"GCOL\x01\0\0\0", image):
            at, end = heap.start() + 16, heap.start() + int.from_bytes(image[heap.end() : heap.end() + 8], "little")
            while at + 16 <= min(end, len(image)):
                number, size = struct.unpack("<H6xQ", image[at : at + 16])
                step = (16 + (size + 7) // 8 * 8) % 2**64 if number else size
                if step == 0:
                    return True
                at += step
    return False
