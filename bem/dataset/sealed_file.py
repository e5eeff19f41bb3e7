"""HDF5 files whose first block states the SHA-256 sum of all their other bytes, so that any damage is detected.

HDF5 leaves the first block of a file to its users (the user block). Every HDF5 program reads a sealed file as it is; a
reader that knows the seal compares the sum first, so that the HDF5 library, which may hang or crash on damaged bytes,
never sees them. The block is text, filled up with zero bytes:

    viscoelastic-contact-dataset: SHA-256 sum of all bytes after the first 512
    9f86d081...

The earliest files have no seal: they have HDF5's own checksums, and a file `SHA256SUMS` beside them states their sums.
"""

import hashlib
import mmap
import re
import struct
from collections.abc import Iterator
from contextlib import contextmanager, suppress
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
"""Root attribute of sealed files; it reveals a file that has lost its first block."""
LARGEST_RATIO = 1100
"""Largest compression ratio of HDF5's gzip filter; an array that claims more bytes cannot be in the file."""
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
        with path.open("rb") as content:
            # A file that is cut within these first bytes counts too.
            sealed, hdf5 = (mark.startswith(_begin(content, len(mark))) for mark in (TITLE, _HDF5))
            if not sealed and not hdf5:
                raise ValueError(f"{received}, which is not HDF5, or damaged at its beginning")
            intact = _begin(content, BLOCK) == _block(content) if sealed else _may_be_opened(content, path)
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
        if not isinstance(number, np.integer) or number != FORMAT_VERSION:
            number = number.item() if isinstance(number, np.generic) else number
            raise ValueError(f"{received}, which is of version {shown(number)}")
        if lost:
            raise damaged
        yield file


def arrays(file: h5py.File) -> Iterator[tuple[str, h5py.Dataset]]:
    """Yield path and HDF5 data set of each array of an open file, without reading it.

    HDF5 can fetch arrays from other files: by links, as external storage, as virtual data sets. A file of unknown
    origin could then expose other files of this machine, so all of these are refused.

    Raises:
        ValueError: an array lies outside the file, or claims more bytes than the file can hold.
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
        if item.nbytes > LARGEST_RATIO * file.id.get_filesize():
            raise ValueError(f"{where} claims {item.nbytes} bytes, more than the file can hold")
        yield path, item


def _begin(content: BinaryIO, size: int) -> bytes:
    content.seek(0)
    return content.read(size)


def _block(content: BinaryIO) -> bytes:
    """The first block that belongs to the other bytes of a file."""
    digest = hashlib.sha256()
    content.seek(BLOCK)
    while part := content.read(2**20):
        digest.update(part)
    return (TITLE + digest.hexdigest().encode() + b"\n").ljust(BLOCK, b"\0")


def _is_written_to(content: BinaryIO, first_block: int) -> bool:
    """Whether the HDF5 library has marked a file as open for writing, in the superblock behind a free first block."""
    superblock = _begin(content, first_block + 24)[first_block:]
    return superblock.startswith(_HDF5) and len(superblock) == 24 and superblock[20 if superblock[8] < 2 else 11] == 1


def _may_be_opened(content: BinaryIO, path: Path) -> bool:
    """Whether a file without a seal has its sum in `SHA256SUMS` or, without one, does not hang the HDF5 library."""
    with suppress(OSError, ValueError):
        for line in path.with_name("SHA256SUMS").read_text(encoding="utf-8").splitlines():
            if line.split()[1:] == [path.name]:
                content.seek(0)
                return hashlib.file_digest(content, "sha256").hexdigest() == line.split()[0]
    return not _hangs(content)


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
