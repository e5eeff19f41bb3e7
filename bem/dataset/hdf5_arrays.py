"""The arrays of an HDF5 file, all of which must lie in the file itself.

HDF5 can fetch arrays from other files: by links, as external storage, as virtual data sets. A file of unknown
origin could then expose other files of this machine, so all of these are refused.
"""

from collections.abc import Iterator
from typing import Any

import h5py

from bem._support.wording import shortened

LARGEST_RATIO = 1100
"""Largest compression ratio of HDF5's gzip filter; an array that claims more bytes cannot be in the file."""


def arrays(file: h5py.File) -> Iterator[tuple[str, h5py.Dataset]]:
    """Yield path and HDF5 data set of each array of an open file, without reading it.

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
