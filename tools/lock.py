"""Check that both lock files belong to `pyproject.toml`, or resolve it again into all lock files.

`requirements-small.lock` holds what `make setup-small` installs. The first line of a lock file holds a SHA-256 digest
of the parts of `pyproject.toml` that decide the resolution. The check needs no network: it compares the digest,
compares every direct requirement with the locked version, and requires that each locked package has a hash and that
the file names no package index.

Usage: `python tools/lock.py check` or `python tools/lock.py resolve`, as `make check-lock` and `make lock` do.
"""

import hashlib
import json
import re
import subprocess
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
COMPILE = "pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header"
NEWEST = ("keras", "pytest", "hypothesis", "fsspec", "jinja2", "networkx", "sympy")
"""What the tests with the newest Keras need; the last four are what PyTorch needs."""
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


def resolve(settings: dict) -> None:
    """Resolve `pyproject.toml` into all lock files, by uv, and stamp the two that are checked; it needs the network.

    Raises:
        FileNotFoundError: There is no uv beside this Python.
    """
    uv, versions = Path(sys.executable).with_name("uv"), ROOT / "results" / "versions.txt"
    if not uv.is_file():
        raise FileNotFoundError(f"uv not found at {str(uv)!r}; run `make setup` first")

    def compiled(lock: str, *options: str, more: tuple[str, ...] = ()) -> None:
        command = [uv, *COMPILE.split(), *options, "--output-file", lock, "pyproject.toml", *(["-"] if more else [])]
        subprocess.run(command, cwd=ROOT, input="\n".join(more), text=True, check=True)

    full, small = LOCKS
    compiled(full, *(word for name in locked_groups(settings) for word in ("--extra", name)))
    # The same versions where they exist, which is below Python 3.13; setuptools installs this package.
    below = []
    for line in re.findall(r"^[a-z].*==.*", (ROOT / full).read_text(encoding="utf-8"), re.MULTILINE):
        pinned, _, marker = line.removesuffix(" \\").partition(" ; ")
        below.append(f'{pinned} ; python_full_version < "3.13"' + (f" and ({marker})" if marker else ""))
    versions.parent.mkdir(exist_ok=True)
    versions.write_text("\n".join(below) + "\n", encoding="utf-8")
    newer = ("setuptools>=77", 'numpy>=2.1; python_version >= "3.13"')
    compiled(small, "--extra", "tables", "--constraint", str(versions), "--no-annotate", more=newer)
    for name in LOCKS:
        text = (ROOT / name).read_text(encoding="utf-8")
        body = "".join(line for line in text.splitlines(keepends=True) if not line.startswith(STAMP))
        (ROOT / name).write_text(f"{STAMP}{input_digest(settings)}\n{body}", encoding="utf-8")
    compiled("requirements-newest.txt", "--upgrade", "--no-annotate", more=NEWEST)


def main(action: str) -> int:
    """Run one action and return the exit status, which is 1 if the lock file does not match."""
    settings = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))
    if action not in ("check", "resolve"):
        raise ValueError(f"action must be 'check' or 'resolve'; received {action!r}")
    if action == "resolve":
        resolve(settings)
    found = [
        f"{name}: {sentence}"
        for name, groups in LOCKS.items()
        for sentence in problems(settings, (ROOT / name).read_text(encoding="utf-8"), groups)
    ]
    for sentence in found:
        print(f"{sentence}; run `make lock`", file=sys.stderr)
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1] if len(sys.argv) > 1 else "check"))
