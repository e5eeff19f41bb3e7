"""What a command costs before it computes: processor seconds of its first run on a machine, and of a warm run.

The first run compiles the kernels into an empty cache; a warm run finds them there. Another revision can be measured
too; the two then take turns, so that the ratio is valid on a machine of any speed and load.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Annotated

import typer

from experiments.solver.revision_comparison import checked_out
from experiments.solver.solver_processes import ROOT

COMMAND = ["-m", "bem", "simulate", "--tabor", "3.2", "--peak-indentation", "15", "--loading-rate", "1000"]
COMMAND += ["--dwell-time", "0.008", "--unloading-rate", "1000"]


def command_seconds(source: Path, **environment: str) -> tuple[float, float]:
    """Wall and processor seconds of the command with the package in `source` and additional environment variables."""
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    environment = {**os.environ, "PYTHONPATH": str(source), **environment}
    subprocess.run([sys.executable, *COMMAND], cwd=source, env=environment, check=True, capture_output=True)
    wall, after = time.perf_counter() - started, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def processor_seconds(source: Path, cache: Path) -> float:
    """Processor seconds of the command, with its compiled kernels in `cache`."""
    return command_seconds(source, NUMBA_CACHE_DIR=str(cache))[1]


def main(
    baseline: Annotated[str, typer.Option(help="Git revision to compare with; none by default.")] = "",
    repeats: Annotated[int, typer.Option(min=1, help="Warm runs of each.")] = 5,
) -> None:
    """Print processor seconds of the first run and of warm runs of `bem simulate`."""
    with tempfile.TemporaryDirectory() as scratch:
        sources = {"now": ROOT}
        if baseline:
            sources[baseline] = checked_out(baseline, Path(scratch, "baseline"))
        caches = {name: Path(scratch, f"cache-{number}") for number, name in enumerate(sources)}
        first = {name: processor_seconds(source, caches[name]) for name, source in sources.items()}
        warm: dict[str, list[float]] = {name: [] for name in sources}
        for _ in range(repeats):
            for name, source in sources.items():
                warm[name].append(processor_seconds(source, caches[name]))
    print(f"{'':12} {'first run (s)':>14} {'warm run (s)':>14}")
    for name in sources:
        print(f"{name[:12]:12} {first[name]:14.1f} {median(warm[name]):14.2f}")
    if baseline:
        ratios = [one / other for one, other in zip(warm["now"], warm[baseline], strict=True)]
        print(f"{'ratio':12} {first['now'] / first[baseline]:14.2f} {median(ratios):14.2f}")
