"""Keep `published/MANIFEST.json`: the SHA-256 sum, the size and the origin of each published file.

The origin of a file is read from the file itself (root attributes of HDF5, keys of JSON) or, for the files of a model
directory, from the `run.json` in that directory; cards and their metadata come from `make cards`. Options add what is
missing.

Usage: `python tools/manifest.py add PATH ... [--command C] [--seed N] [--seconds S]`, where a folder stands for all its
files; `python tools/manifest.py verify` compares every published file with the manifest. The folder may contain no
other files, and no links.
"""

import argparse
import hashlib
import json
import sys
from pathlib import Path
from typing import Any

import h5py

from bem._support.command_line import sentence
from bem._support.outputs import write_whole
from bem._support.wording import shortened, shown

ROOT = Path(__file__).resolve().parent.parent / "published"
NAME = "MANIFEST.json"
IGNORED = {NAME, "README.md"}
"""Files of the root folder that have no entry."""


def read(root: Path) -> dict[str, dict[str, Any]]:
    """Entries by path relative to `root`; empty if there is no manifest yet.

    Raises:
        ValueError: The file is not a manifest, or an entry lacks sum or size.
    """
    path = root / NAME
    if not path.is_file():
        return {}
    try:
        entries = dict(json.loads(path.read_text(encoding="utf-8"))["files"])
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise ValueError(f"expected a manifest with a table of files; received {str(path)!r}") from error
    for name, entry in entries.items():
        if not (isinstance(entry, dict) and {"sha256", "bytes"} <= entry.keys()):
            without = f"received {str(path)!r} without, for {shown(name)}"
            raise ValueError(f"expected sha256 and bytes of every file; {without}")
    return entries


def origin(path: Path) -> dict[str, Any]:
    """Command, versions, seed, revision, host and seconds, if the file or the `run.json` in its folder states them."""
    if path.name == "README.md" or path.name.endswith(".croissant.json"):
        return {"command": "make cards"}
    if path.suffix == ".h5" and h5py.is_hdf5(path):
        with h5py.File(path, "r") as file:
            found = {name: _plain(value) for name, value in file.attrs.items()}
    elif path.suffix == ".json":
        content = json.loads(path.read_text(encoding="utf-8"))
        found = content if isinstance(content, dict) else {}
    else:
        found = {}
    if "command" not in found and (path.parent / "run.json").is_file():
        found = json.loads((path.parent / "run.json").read_text(encoding="utf-8"))
    told = {name: found[name] for name in ("command", "versions", "seed", "git_revision", "host") if name in found}
    seconds = found.get("wall_seconds", found.get("seconds"))
    return told | ({"seconds": round(float(seconds), 1)} if isinstance(seconds, int | float) else {})


def add(root: Path, paths: list[Path], **given: Any) -> list[str]:
    """Add files, and all files of folders, to the manifest; entries of files that no longer exist are removed.

    Returns:
        The names of the added files.

    Raises:
        FileNotFoundError: A file does not exist.
        ValueError: A file is a link, lies outside `root`, or has no known command.
    """
    entries = {name: entry for name, entry in read(root).items() if (root / name).is_file()}
    entered = []
    for path in paths:
        if not path.exists():
            raise FileNotFoundError(f"published file not found; received {str(path)!r}")
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            if file.is_symlink():
                raise ValueError(f"published files must not be links; received {str(file)!r}")
            if not file.is_file() or file in [root / name for name in IGNORED]:
                continue
            if not file.resolve().is_relative_to(root.resolve()):
                raise ValueError(f"published files must lie in {root.name!r}; received {str(file)!r}")
            name = file.resolve().relative_to(root.resolve()).as_posix()
            made = origin(file) | {key: value for key, value in given.items() if value is not None}
            if not made.get("command"):
                raise ValueError(f"a published file needs the command that made it; received {name!r} without one")
            entries[name] = {"sha256": digest(file), "bytes": file.stat().st_size, **made}
            entered.append(name)
    content = {"files": dict(sorted(entries.items()))}
    write_whole(root / NAME, json.dumps(content, indent=1) + "\n")
    return entered


def problems(root: Path) -> list[str]:
    """One sentence for each disagreement between files and manifest; empty if they match."""
    entries = read(root)
    if not entries:
        return [f"no manifest, or an empty one, in {root.name!r}"]
    # Links are listed too, also those to folders and broken ones.
    listed = (path for path in root.rglob("*") if path.is_symlink() or not path.is_dir())
    present = {path.relative_to(root).as_posix(): path for path in listed}
    found = []
    for name, entry in entries.items():
        path = present.get(name)
        if path is None:
            found.append(f"{name} is missing")
        elif path.is_symlink() or not path.is_file():
            found.append(f"{name} is no plain file")
        elif path.stat().st_size != entry["bytes"] or digest(path) != entry["sha256"]:
            found.append(f"{name} is not the file that was published")
    return found + [f"{name} is not in the manifest" for name in sorted(present.keys() - entries.keys() - IGNORED)]


def digest(path: Path) -> str:
    """SHA-256 sum of a file, in hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _plain(value: Any) -> Any:
    if isinstance(value, str) and value.startswith("{"):
        return json.loads(value)
    return value.item() if hasattr(value, "item") else value


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Keep and check the manifest of published files.")
    parser.add_argument("--root", type=Path, default=ROOT)
    commands = parser.add_subparsers(dest="action", required=True)
    adding = commands.add_parser("add")
    adding.add_argument("paths", nargs="+", type=Path)
    adding.add_argument("--command")
    adding.add_argument("--seed", type=int)
    adding.add_argument("--seconds", type=float)
    commands.add_parser("verify")
    given = parser.parse_args()
    try:
        if given.action == "add":
            before = read(given.root)
            names = add(given.root, given.paths, command=given.command, seed=given.seed, seconds=given.seconds)
            after = read(given.root)
            changed = [name for name in names if before.get(name) != after[name]]
            for name in changed:
                print(f"{name} is in the manifest")
            if len(changed) < len(names):
                print(f"unchanged: {len(names) - len(changed)}")
            return 0
        found = problems(given.root)
    except (ValueError, OSError) as error:
        print(f"manifest: {sentence(error)}", file=sys.stderr)
        return 2
    for problem in found:
        print(f"manifest: {shortened(problem)}", file=sys.stderr)
    if not found:
        print(f"{len(read(given.root))} published files match the manifest")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
