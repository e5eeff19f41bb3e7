"""A file whose first block states the SHA-256 sum of all its other bytes, so that any damage is detected.

HDF5 leaves the first block of a file to its users (the user block). Every HDF5 program reads a sealed file as it is; a
reader that knows the seal compares the sum first, so that the HDF5 library, which may hang or crash on damaged bytes,
never sees them. The block is text, filled up with zero bytes:

    viscoelastic-contact-dataset: SHA-256 sum of all bytes after the first 512
    9f86d081...
"""

import hashlib
from typing import BinaryIO

BLOCK = 512
"""Size of the first block in bytes, the smallest that HDF5 allows."""
TITLE = f"viscoelastic-contact-dataset: SHA-256 sum of all bytes after the first {BLOCK}\n".encode()
_AT_ONCE = 2**20


def seal(file: BinaryIO) -> None:
    """Write the first block of a file that is otherwise complete."""
    block = _block(file)
    file.seek(0)
    file.write(block)


def is_sealed(file: BinaryIO) -> bool:
    """Whether a file begins with the first line of a seal; a file cut within that line counts too."""
    file.seek(0)
    begin = file.read(len(TITLE))
    return TITLE.startswith(begin)


def is_intact(file: BinaryIO) -> bool:
    """Whether the first block of a sealed file states the sum of its other bytes."""
    file.seek(0)
    return file.read(BLOCK) == _block(file)


def _block(file: BinaryIO) -> bytes:
    digest = hashlib.sha256()
    file.seek(BLOCK)
    while part := file.read(_AT_ONCE):
        digest.update(part)
    return (TITLE + digest.hexdigest().encode() + b"\n").ljust(BLOCK, b"\0")
