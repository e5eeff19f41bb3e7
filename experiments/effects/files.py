"""Which code of `bem` a scene runs: its files, functions and lines, found by running it.

A simulation on a tiny protocol runs in a process of its own with compilation off and every line noted, so that a
page or a table names the files that really ran. LAPACK is called through SciPy there, because its linker symbols
exist in compiled code only.
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
"""Lines run: file by its name in `bem/` without the ending, function, and number."""


def code_of(scenes: dict[str, bem.Scene]) -> dict[str, Code]:
    """Lines of `bem` that the simulation of each scene runs."""
    with ProcessPoolExecutor(1, initializer=_use_scipy, env={"NUMBA_DISABLE_JIT": "1"}) as alone:
        return dict(zip(scenes, alone.map(_traced, scenes.values()), strict=True))


def own_files(code: dict[str, Code]) -> dict[str, list[str]]:
    """By scene, files with functions that not every scene runs."""
    every = set.intersection(*map(functions_of, code.values()))
    return {name: sorted({file for file, _ in functions_of(one) - every}) for name, one in code.items()}


def shared_files(code: dict[str, Code]) -> list[str]:
    """Files of which every scene runs some function."""
    return sorted(set.intersection(*({file for file, *_ in one} for one in code.values())))


def branches(code: dict[str, Code]) -> dict[str, dict[str, int]]:
    """By scene and file, lines that not every scene runs."""
    every = set.intersection(*map(lines_of, code.values()))
    return {name: dict(Counter(file for file, _ in sorted(lines_of(one) - every))) for name, one in code.items()}


def functions_of(one: Code) -> set[tuple[str, str]]:
    """Pairs of file and function; neither helpers nor methods, which come with who calls and what describes a scene."""
    return {(file, name) for file, name, _ in one if "." not in name and name[0] != "_"}


def lines_of(one: Code) -> set[tuple[str, int]]:
    """Pairs of file and line."""
    return {(file, line) for file, _, line in one}


def _use_scipy() -> None:
    import numpy as np
    from scipy.linalg.lapack import dgetrf, dgetrs

    import bem._support.linear_algebra as algebra

    def lu_factor(columns: np.ndarray, order: int, pivots: np.ndarray) -> None:
        columns[:order, :order], pivots[:order], _ = dgetrf(columns[:order, :order])

    def lu_solve(columns: np.ndarray, order: int, pivots: np.ndarray, rhs: np.ndarray) -> None:
        rhs[:order] = dgetrs(columns[:order, :order], pivots[:order], rhs[:order], trans=1)[0]

    def add_rows(rows: np.ndarray, factors: np.ndarray, out: np.ndarray) -> None:
        out += factors @ rows

    algebra.lu_factor, algebra.lu_solve, algebra.add_rows, algebra.dot = lu_factor, lu_solve, add_rows, np.dot


def _traced(scene: bem.Scene) -> Code:
    # What an earlier scene left in a cache would look like code that this one does not run.
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
    bem.simulate(scene, protocol, 0.05)  # not noted: what is imported on first use belongs to no scene
    sys.settrace(passed)
    try:
        trajectory = bem.simulate(scene, protocol, 0.05)
    finally:
        sys.settrace(None)
    if not trajectory.completed:
        raise RuntimeError(f"the traced simulation must complete; received {trajectory.status!r}")
    return found
