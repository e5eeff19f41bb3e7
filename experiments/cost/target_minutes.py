"""Minutes that each target of REPRODUCING.md takes from published results, each into an empty folder.

The targets are those of the Makefile's registry, so that a figure added there is measured too. `make setup` is not
counted. Compiled kernels are kept between targets, as on a machine on which one target has already run.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Annotated

import typer

from bem._support.provenance import host
from experiments.common import write_result
from experiments.registry import MAKEFILE, WHOLE, entries
from experiments.timing import MEASUREMENTS, Out, progress

OUT = MEASUREMENTS / "target_minutes.json"
EMPTY = Path("build")
"""Folder in which the empty folders are created."""


def targets(makefile: Path) -> list[str]:
    """The paper's figures and tables in the Makefile's registry, and the targets that make all of them."""
    return [*(entry.name for entry in entries(makefile) if entry.kind == "paper"), *WHOLE]


def joined(target: str) -> str:
    """Name of several targets as one word."""
    return target.replace(" ", "-")


def minutes(target: str) -> float:
    """Wall minutes of one call of make.

    Raises:
        RuntimeError: make failed; the message holds the end of its error output.
    """
    EMPTY.mkdir(exist_ok=True)
    # A make that runs this program passes its options on; a user who types the target has none of them.
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("MAKE", "MFLAGS"))}
    with tempfile.TemporaryDirectory(dir=EMPTY) as folder:
        # Relative, so that a path with spaces does not reach make.
        place = os.path.relpath(folder)
        settings = [f"OUT={place}", f"REPORT={place}/REPRODUCTION.md", "REPRODUCING=", f"SMOKE={place}/smoke"]
        started = time.perf_counter()
        done = subprocess.run(
            ["make", "--no-print-directory", *settings, *target.split()],
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        spent = time.perf_counter() - started
    if done.returncode:
        raise RuntimeError(f"`make {target}` failed: {' '.join(done.stderr.split())[-400:]}")
    return spent / 60.0


def main(
    makefile: Annotated[Path, typer.Option(help="Makefile whose registry lists the targets.")] = MAKEFILE,
    only: Annotated[list[str] | None, typer.Option(help="Measure this target only (figures-tables).")] = None,
    out: Out = OUT,
) -> None:
    """Run every target once and write the minutes."""
    known = {joined(target): target for target in targets(makefile)}
    if unknown := [name for name in only or [] if joined(name) not in known]:
        raise ValueError(f"only must be one of {', '.join(known)}; received {unknown[0]!r}")
    kept = json.loads(out.read_text(encoding="utf-8")) if only and out.is_file() else {"host": host(), "minutes": {}}
    if kept["host"] != host():
        raise ValueError(f"rows must be of one machine; received {str(out)!r} of {kept['host']}: measure all targets")
    chosen = [known[joined(name)] for name in only] if only else list(known.values())
    taken = kept["minutes"] | {target: minutes(target) for target in progress(chosen, "targets")}
    found = {target: taken[target] for target in known.values() if target in taken}
    write_result(out, "target_minutes", {"minutes": found})
