"""Where a result file comes from: versions, machine, revision and command, without paths or names of the machine."""

import functools
import os
import platform
import shlex
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "h5py", "joblib", "contact-trajectories")


def provenance(command: str) -> dict[str, Any]:
    """Attributes `versions`, `host`, `git_revision` and `command` of a result file."""
    return origin() | {"git_revision": git_revision(), "command": command}


def origin() -> dict[str, Any]:
    """Versions and host alone: what a worker adds to its results, since it may run elsewhere."""
    return {"versions": versions(), "host": host()}


def merged(origins: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """One dictionary of many: what all agree on as it is, and a list of the different values otherwise."""
    values: dict[str, list[Any]] = {}
    for facts in origins:
        for name, value in facts.items():
            distinct = values.setdefault(name, [])
            distinct += [entry for entry in (value if isinstance(value, list) else [value]) if entry not in distinct]
    return {name: distinct[0] if len(distinct) == 1 else distinct for name, distinct in values.items()}


def command_line(arguments: Sequence[str]) -> str:
    """What was typed, without the folder of the program: 'bem ...', or 'python -m bem ...'."""
    program = Path(arguments[0])
    name = f"python -m {program.parent.name}" if program.name == "__main__.py" else shlex.quote(program.name)
    return " ".join([name, *map(shlex.quote, arguments[1:])])


@functools.cache
def versions() -> dict[str, str]:
    """Versions of Python and of the packages that decide numbers; those not installed are left out."""
    installed = {"python": platform.python_version()}
    for package in PACKAGES:
        with suppress(PackageNotFoundError):
            installed[package] = version(package)
    return installed


def peak_memory() -> int:
    """Largest memory this process has held so far, in bytes; 0 on systems that do not tell."""
    try:
        import resource
    except ImportError:
        return 0
    unit = 1 if sys.platform == "darwin" else 1024
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


@functools.cache
def host() -> str:
    """System, processor and number of cores, e.g. 'Linux x86_64, 8 cores of Some Processor'."""
    model = platform.processor() or "an unnamed processor"
    information = Path("/proc/cpuinfo")
    if information.is_file():
        lines = information.read_text(encoding="utf-8", errors="replace").splitlines()
        names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
        model = names[0] if names else model
    return f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores of {model}"


@functools.cache
def git_revision() -> str:
    """Revision of the working copy this package runs from, with '-dirty' for changed files; 'unknown' outside one."""
    try:
        _git("ls-files", "--error-unmatch", Path(__file__).name)  # not installed into an environment inside another one
        return _git("describe", "--always", "--abbrev=40", "--dirty", "--exclude=*")
    except (OSError, subprocess.SubprocessError):
        return "unknown"


def _git(*arguments: str) -> str:
    folder = Path(__file__).parent
    answer = subprocess.run(["git", *arguments], cwd=folder, capture_output=True, text=True, check=True, timeout=10)
    return answer.stdout.strip()
