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
    with Path(path).open("r+b") as content:
        seal(content)


def damaged(content, rng, kinds=("flip", "zero", "overwrite", "cut", "insert", "remove", "repeat")):
    """The bytes with one random damage."""
    found, place = bytearray(content), rng.randrange(len(content))
    size = rng.choice((1, 8, 64, 512, 4096))
    kind = rng.choice(kinds)
    if kind == "flip":
        found[place] ^= 1 << rng.randrange(8)
    elif kind == "zero":
        found[place : place + size] = bytes(len(found[place : place + size]))
    elif kind == "overwrite":
        found[place : place + size] = rng.randbytes(len(found[place : place + size]))
    elif kind == "cut":
        del found[place:]
    elif kind == "insert":
        found[place:place] = rng.randbytes(size)
    elif kind == "repeat":
        found[place:place] = found[(other := rng.randrange(len(content))) : other + size]
    else:
        del found[place : place + size]
    return bytes(found)
