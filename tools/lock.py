"""Check that both lock files belong to `pyproject.toml`, or stamp new ones with the digest of their inputs.

`requirements-small.lock` holds what `make setup-small` installs. The first line of a lock file holds a SHA-256 digest
of the parts of `pyproject.toml` that decide the resolution. The check needs no network: it compares the digest,
compares every direct requirement with the locked version, and requires that each locked package has a hash and that
the file names no package index.

Usage: `python tools/lock.py check` or `python tools/lock.py stamp`, which `make lock` calls.
"""

import hashlib
import json
import re
import sys
import tomllib
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parent.parent
PYPROJECT = ROOT / "pyproject.toml"
LOCKS = {"requirements.lock": None, "requirements-small.lock": ("tables",)}
"""Lock files, and the optional groups that each holds; None for all."""
STAMP = "# inputs sha256: "
UNLOCKED = {"peers"}
"""Optional groups that are not in the lock file: they pin their requirements, and are installed by hand."""
PINNED = re.compile(r"^([A-Za-z0-9._-]+)==([^\s;\\]+)")


def locked_groups(settings: dict) -> dict[str, list[str]]:
    """Optional groups of a parsed `pyproject.toml` that the lock file holds."""
    groups = settings["project"].get("optional-dependencies", {})
    return {name: group for name, group in groups.items() if name not in UNLOCKED}


def input_digest(settings: dict) -> str:
    """Digest of the requirement tables of a parsed `pyproject.toml`."""
    project = settings["project"]
    inputs = {
        "requires-python": project["requires-python"],
        "dependencies": project["dependencies"],
        "optional-dependencies": locked_groups(settings),
        "constraints": settings.get("tool", {}).get("uv", {}).get("constraint-dependencies", []),
    }
    return hashlib.sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()


def direct_requirements(settings: dict, names: tuple[str, ...] | None = None) -> list[Requirement]:
    """Requirements that the project states itself, including those of the locked groups, or of the named ones."""
    locked = locked_groups(settings)
    groups = (settings["project"]["dependencies"], *(locked[name] for name in (locked if names is None else names)))
    return [Requirement(text) for group in groups for text in group]


def problems(settings: dict, lock_text: str, names: tuple[str, ...] | None = None) -> list[str]:
    """One sentence for each disagreement between lock file and project; empty if they match."""
    found = []
    first_line = lock_text.partition("\n")[0]
    if first_line != STAMP + input_digest(settings):
        found.append("the dependencies in pyproject.toml changed after the lock was made")
    locked: dict[str, list[str]] = {}
    for entry in re.split(r"\n(?=[A-Za-z0-9])", lock_text):
        if match := PINNED.match(entry):
            locked.setdefault(canonicalize_name(match[1]), []).append(match[2])
            if "--hash=sha256:" not in entry:
                found.append(f"{match[1]}=={match[2]} has no hash")
    for requirement in direct_requirements(settings, names):
        versions = locked.get(canonicalize_name(requirement.name), [])
        if not versions:
            found.append(f"{requirement.name} is not in the lock")
        found += [
            f"{requirement} is required, {version} is locked"
            for version in versions
            if not requirement.specifier.contains(version, prereleases=True)
        ]
    if re.search(r"--(extra-)?index-url|--find-links|://", lock_text):
        found.append("the lock names a package index")
    return found


def main(action: str) -> int:
    """Run one action and return the exit status, which is 1 if the lock file does not match."""
    settings = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))
    if action not in ("check", "stamp"):
        raise ValueError(f"action must be 'check' or 'stamp'; received {action!r}")
    found = []
    for name, groups in LOCKS.items():
        text = (ROOT / name).read_text(encoding="utf-8")
        if action == "check":
            found += [f"{name}: {sentence}" for sentence in problems(settings, text, groups)]
            continue
        body = "".join(line for line in text.splitlines(keepends=True) if not line.startswith(STAMP))
        (ROOT / name).write_text(f"{STAMP}{input_digest(settings)}\n{body}", encoding="utf-8")
    for sentence in found:
        print(f"{sentence}; run `make lock`", file=sys.stderr)
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1] if len(sys.argv) > 1 else "check"))
