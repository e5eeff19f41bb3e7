"""The arrays of an HDF5 file, all of which must lie in the file itself.

HDF5 can fetch arrays from other files: by links, as external storage, as virtual data sets. A file from elsewhere would
then show what lies on this machine, so that all of these are refused.
"""

from collections.abc import Iterator
from typing import Any

import h5py

from bem._support.wording import shortened

LARGEST_RATIO = 1100
"""The best compression that HDF5's gzip filter reaches; an array said to be larger is not in the file."""


def arrays(file: h5py.File) -> Iterator[tuple[str, h5py.Dataset]]:
    """Yield path and data set of each array of an open file, unread.

    Raises:
        ValueError: something in the file leads elsewhere, or claims to be more than the file can hold.
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
