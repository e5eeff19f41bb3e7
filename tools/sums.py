"""Keep `SHA256SUMS` of a folder of published files: a line for each file, which `sha256sum --check` reads.

Usage: `python tools/sums.py FOLDER PATH ...` renews the lines of these files, and of all files of these folders, and
drops those of files that are gone. Every other line stays, so that a damaged file is not taken for a published one.
"""

import hashlib
import sys
from pathlib import Path

NAME = "SHA256SUMS"


def read(folder: Path) -> dict[str, str]:
    """Sums by path relative to the folder; empty if there are none yet."""
    path = folder / NAME
    lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    return {name: found for found, _, name in (line.partition("  ") for line in lines)}


def add(folder: Path, paths: list[Path]) -> None:
    """Renew the lines of files, and of all files of folders.

    Raises:
        FileNotFoundError: A file does not exist.
        ValueError: A file is a link, or lies outside the folder.
    """
    sums = {name: found for name, found in read(folder).items() if (folder / name).is_file()}
    for path in paths:
        if not path.exists():
            raise FileNotFoundError(f"published file not found; received {str(path)!r}")
        for file in [path] if path.is_file() else path.rglob("*"):
            if file.is_symlink() or not file.resolve().is_relative_to(folder.resolve()):
                raise ValueError(
                    f"published files must lie in {str(folder)!r}, and be no links; received {str(file)!r}"
                )
            if file.is_file() and file.name != NAME:
                name = file.resolve().relative_to(folder.resolve()).as_posix()
                sums[name] = hashlib.sha256(file.read_bytes()).hexdigest()
    text = "".join(f"{found}  {name}\n" for name, found in sorted(sums.items()))
    (folder / f"{NAME}.new").write_text(text, encoding="utf-8")
    (folder / f"{NAME}.new").replace(folder / NAME)


if __name__ == "__main__":
    try:
        add(Path(sys.argv[1]), [Path(word) for word in sys.argv[2:]])
    except (OSError, ValueError) as error:
        sys.exit(f"sums: {error}")
