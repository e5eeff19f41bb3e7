"""Which code of `bem` a scene runs: files, functions and lines, found by tracing a simulation.

A simulation of a tiny protocol runs in a separate process with compilation switched off, and every executed line is
recorded. Documents and tables can therefore name the files that really run. LAPACK is called through SciPy there,
because its linker symbols exist in compiled code only.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from types import FrameType
from typing import Any

from loky import ProcessPoolExecutor

import bem

HOME = str(Path(bem.__file__).parent)
Code = set[tuple[str, str, int]]
"""Executed lines: name of the file without its suffix, qualified name of the function, and line number."""


def code_of(scenes: dict[str, bem.Scene]) -> dict[str, Code]:
    """Executed lines of `bem` in the simulation of each scene."""
    with ProcessPoolExecutor(1, initializer=_use_scipy, env={"NUMBA_DISABLE_JIT": "1"}) as alone:
        return dict(zip(scenes, alone.map(_traced, scenes.values()), strict=True))


def own_files(code: dict[str, Code]) -> dict[str, list[str]]:
    """For each scene, the files with functions that some other scene does not run."""
    every = set.intersection(*map(functions_of, code.values()))
    return {name: sorted({file for file, _ in functions_of(one) - every}) for name, one in code.items()}


def shared_files(code: dict[str, Code]) -> list[str]:
    """Files that every scene runs."""
    return sorted(set.intersection(*({file for file, *_ in one} for one in code.values())))


def branches(code: dict[str, Code]) -> dict[str, dict[str, int]]:
    """For each scene and file, the number of lines that some other scene does not run."""
    every = set.intersection(*map(lines_of, code.values()))
    return {name: dict(Counter(file for file, _ in sorted(lines_of(one) - every))) for name, one in code.items()}


def functions_of(one: Code) -> set[tuple[str, str]]:
    """Pairs of file and public function; methods and private functions are left out, since their callers decide."""
    return {(file, name) for file, name, _ in one if "." not in name and name[0] != "_"}


def lines_of(one: Code) -> set[tuple[str, int]]:
    """Pairs of file and line number."""
    return {(file, line) for file, _, line in one}


def _use_scipy() -> None:
    import numpy as np
    from scipy.linalg.lapack import dgetrf, dgetrs

    import bem._numerics.linear_algebra as algebra

    def lu_factor(columns: np.ndarray, order: int, pivots: np.ndarray) -> None:
        columns[:order, :order], pivots[:order], _ = dgetrf(columns[:order, :order])

    def lu_solve(columns: np.ndarray, order: int, pivots: np.ndarray, rhs: np.ndarray) -> None:
        rhs[:order] = dgetrs(columns[:order, :order], pivots[:order], rhs[:order], trans=1)[0]

    def add_rows(rows: np.ndarray, factors: np.ndarray, out: np.ndarray) -> None:
        out += factors @ rows

    algebra.lu_factor, algebra.lu_solve, algebra.add_rows, algebra.dot = lu_factor, lu_solve, add_rows, np.dot


def _traced(scene: bem.Scene) -> Code:
    # Code is not run if an earlier scene has left its result in a cache.
    for module in [module for name, module in sys.modules.items() if name.startswith("bem.")]:
        for value in vars(module).values():
            if callable(getattr(value, "cache_clear", None)):
                value.cache_clear()
    found: Code = set()

    def passed(frame: FrameType, event: str, _argument: Any) -> Any:
        code = frame.f_code
        if not code.co_filename.startswith(HOME):
            return None
        if event == "line":
            found.add((Path(code.co_filename).stem, code.co_qualname, frame.f_lineno))
        return passed

    depth = scene.tabor
    protocol = bem.LoadingProtocol(
        peak_indentation=depth, loading_rate=20.0 * depth, dwell_time=0.1, unloading_rate=20.0 * depth
    )
    bem.simulate(scene, protocol, 0.05)  # not recorded: imports on first use belong to no scene
    sys.settrace(passed)
    try:
        trajectory = bem.simulate(scene, protocol, 0.05)
    finally:
        sys.settrace(None)
    if not trajectory.completed:
        raise RuntimeError(f"the traced simulation must complete; received {trajectory.status!r}")
    return found
