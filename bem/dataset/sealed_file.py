"""HDF5 files whose first block states the SHA-256 sum of all their other bytes, so that any damage is detected.

HDF5 leaves the first block of a file to its users (the user block). Every HDF5 program reads a sealed file as it is; a
reader that knows the seal compares the sum first, so that the HDF5 library, which may hang or crash on damaged bytes,
never sees them. The block is text, filled up with zero bytes:

    viscoelastic-contact-dataset: SHA-256 sum of all bytes after the first 512
    9f86d081...
"""

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np

from bem._support.wording import shortened, shown

FORMAT, FORMAT_VERSION = "viscoelastic-contact-dataset", 1
BLOCK = 512
"""Size of the first block in bytes, the smallest that HDF5 allows."""
TITLE = f"viscoelastic-contact-dataset: SHA-256 sum of all bytes after the first {BLOCK}\n".encode()
SEALED = "sealed"
"""Root attribute that tells a reader of HDF5 of the first block."""
_HDF5 = b"\x89HDF\r\n\x1a\n"


class DamagedFileError(ValueError):
    """A file that is, or was, a data set cannot be read as one."""


def seal(file: BinaryIO) -> None:
    """Write the first block of a file that is otherwise complete."""
    block = _block(file)
    file.seek(0)
    file.write(block)


@contextmanager
def open_dataset(path: str | Path, form: str = FORMAT) -> Iterator[h5py.File]:
    """Open a data set, or another sealed file of this `form`, once its bytes are those written.

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
    received = f"expected a data set of format {form!r}, version {FORMAT_VERSION}; received {str(path)!r}"
    damaged = DamagedFileError(f"{received}, which is truncated or damaged")
    try:
        with path.open("rb") as stream:
            first = _begin(stream, BLOCK)
            if first.startswith(_HDF5):
                raise ValueError(f"{received}, an HDF5 file of another kind, or without the checksum of a data set")
            # A file that is cut within the title counts too.
            if not TITLE.startswith(first[: len(TITLE)]):
                raise ValueError(f"{received}, which is not HDF5, or damaged at its beginning")
            intact = first == _block(stream)
            if not intact and _is_written_to(stream):
                raise ValueError(f"{received}, which another program is writing or has not finished")
    except PermissionError as error:
        raise ValueError(f"{received}, which may not be read") from error
    if not intact:
        raise damaged
    try:
        file = h5py.File(path, "r", locking=False)  # a disk of the network may know no locks
    except Exception as error:  # on a damaged file the library may raise any error
        raise damaged from error
    with file:
        try:
            name, number = file.attrs.get("format"), file.attrs.get("format_version")
        except Exception as error:
            raise damaged from error
        if not isinstance(name, str) or name != form:
            raise ValueError(f"{received}, an HDF5 file of another kind")
        if not isinstance(number, np.integer) or number != FORMAT_VERSION:
            number = number.item() if isinstance(number, np.generic) else number
            raise ValueError(f"{received}, which is of version {shown(number)}")
        yield file


def arrays(file: h5py.File) -> Iterator[tuple[str, h5py.Dataset]]:
    """Yield path and HDF5 data set of each array of an open file, without reading it.

    HDF5 can fetch arrays from other files: by links, as external storage, as virtual data sets. A file of unknown
    origin could then expose other files of this machine, so all of these are refused.

    Raises:
        ValueError: an array lies outside the file.
    """
    links: list[tuple[str, Any]] = []
    file.visititems_links(lambda path, link: links.append((path, link)))
    for path, link in links:
        where = shortened(f"/{path}")
        if not isinstance(link, h5py.HardLink):
            raise ValueError(f"{where} is a link to another place")
        item = file[path]
        if not isinstance(item, h5py.Dataset):
            continue
        if item.is_virtual or item.external:
            raise ValueError(f"{where} is kept in other files")
        yield path, item


def _begin(stream: BinaryIO, size: int) -> bytes:
    stream.seek(0)
    return stream.read(size)


def _block(stream: BinaryIO) -> bytes:
    """The first block that belongs to the other bytes of a file."""
    digest = hashlib.sha256()
    stream.seek(BLOCK)
    while chunk := stream.read(2**20):
        digest.update(chunk)
    return (TITLE + digest.hexdigest().encode() + b"\n").ljust(BLOCK, b"\0")


def _is_written_to(stream: BinaryIO) -> bool:
    """Whether the HDF5 library has marked a file as open for writing, in the superblock behind the first block."""
    superblock = _begin(stream, BLOCK + 24)[BLOCK:]
    return superblock.startswith(_HDF5) and len(superblock) == 24 and superblock[20 if superblock[8] < 2 else 11] == 1
