"""Files changed on purpose: as if written so, or damaged."""

from contextlib import contextmanager
from pathlib import Path

import h5py

from bem.dataset.sealed_file import seal


@contextmanager
def editing(path):
    """Open a file for changes and seal it again."""
    with h5py.File(path, "r+") as file:
        yield file
    with Path(path).open("r+b") as raw:
        seal(raw)


def damaged(original, rng, kinds=("flip", "zero", "overwrite", "cut", "insert", "remove", "repeat")):
    """The bytes with one random damage."""
    damaged_bytes, start = bytearray(original), rng.randrange(len(original))
    size = rng.choice((1, 8, 64, 512, 4096))
    damage = rng.choice(kinds)
    if damage == "flip":
        damaged_bytes[start] ^= 1 << rng.randrange(8)
    elif damage == "zero":
        damaged_bytes[start : start + size] = bytes(len(damaged_bytes[start : start + size]))
    elif damage == "overwrite":
        damaged_bytes[start : start + size] = rng.randbytes(len(damaged_bytes[start : start + size]))
    elif damage == "cut":
        del damaged_bytes[start:]
    elif damage == "insert":
        damaged_bytes[start:start] = rng.randbytes(size)
    elif damage == "repeat":
        damaged_bytes[start:start] = damaged_bytes[(source := rng.randrange(len(original))) : source + size]
    else:
        del damaged_bytes[start : start + size]
    return bytes(damaged_bytes)
