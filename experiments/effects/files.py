"""Which code of `bem` a scene runs: its files, functions and lines, found by running it.

A simulation on a tiny protocol runs in a process of its own with compilation off and every line noted, so that what a
page or a table says about files is what happened. LAPACK is called through SciPy there, because its linker symbols
exist in compiled code only.
"""

from __future__ import annotations

import base64
import json
import os
import pickle
import subprocess
import sys
from pathlib import Path
from types import FrameType
from typing import Any

Code = dict[str, dict[str, list[int]]]
"""Lines run, by file and function; a file by its name in `bem/` without the ending."""


def code_of(scenes: dict[str, Any]) -> dict[str, Code]:
    """Lines of `bem` that the simulation of each scene runs.

    Raises:
        RuntimeError: a simulation failed, with its last line of complaint.
    """
    given = base64.b64encode(pickle.dumps(scenes))
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-m", "experiments.effects.files"],
        input=given,
        capture_output=True,
        cwd=Path(__file__).parents[2],
        env=environment,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"tracing the scenes must succeed; received {done.stderr.decode().splitlines()[-1:]}")
    return json.loads(done.stdout)


def own_files(code: dict[str, Code]) -> dict[str, list[str]]:
    """By scene, files with functions that not every scene runs."""
    every = set.intersection(*(functions_of(one) for one in code.values()))
    return {name: sorted({file for file, _ in functions_of(one) - every}) for name, one in code.items()}


def shared_files(code: dict[str, Code]) -> list[str]:
    """Files of which every scene runs some function."""
    return sorted(set.intersection(*(set(one) for one in code.values())))


def branches(code: dict[str, Code]) -> dict[str, dict[str, int]]:
    """By scene and file, lines that not every scene runs."""
    every = set.intersection(*(lines_of(one) for one in code.values()))
    found: dict[str, dict[str, int]] = {}
    for name, one in code.items():
        counted: dict[str, int] = {}
        for file, _ in sorted(lines_of(one) - every):
            counted[file] = counted.get(file, 0) + 1
        found[name] = counted
    return found


def functions_of(one: Code) -> set[tuple[str, str]]:
    """Pairs of file and function; neither helpers nor methods, which come with who calls and what describes a scene."""
    return {(file, name) for file, functions in one.items() for name in functions if "." not in name and name[0] != "_"}


def lines_of(one: Code) -> set[tuple[str, int]]:
    """Pairs of file and line."""
    return {(file, line) for file, functions in one.items() for lines in functions.values() for line in lines}


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


def _traced(scene: Any) -> Code:
    import bem
    from bem import LoadingProtocol, simulate

    home = str(Path(bem.__file__).parent)
    # What an earlier scene left in a cache would look like code that this one does not run.
    for module in [module for name, module in sys.modules.items() if name.startswith("bem.")]:
        for value in vars(module).values():
            if callable(getattr(value, "cache_clear", None)):
                value.cache_clear()
    found: dict[str, dict[str, set[int]]] = {}

    def entered(frame: FrameType, _event: str, _argument: Any) -> Any:
        code = frame.f_code
        if not code.co_filename.startswith(home):
            return None
        lines = found.setdefault(Path(code.co_filename).stem, {}).setdefault(code.co_qualname, set())

        def passed(here: FrameType, _event: str, _argument: Any) -> Any:
            lines.add(here.f_lineno)
            return passed

        return passed

    depth = scene.tabor
    protocol = LoadingProtocol(
        peak_indentation=depth, loading_rate=20.0 * depth, dwell_time=0.1, unloading_rate=20.0 * depth
    )
    simulate(scene, protocol, 0.05)  # not noted: what is imported on first use belongs to no scene
    sys.settrace(entered)
    try:
        trajectory = simulate(scene, protocol, 0.05)
    finally:
        sys.settrace(None)
    if not trajectory.completed:
        raise RuntimeError(f"the traced simulation must complete; received {trajectory.status!r}")
    return {file: {name: sorted(lines) for name, lines in code.items()} for file, code in found.items()}


def _main() -> None:
    _use_scipy()
    scenes = pickle.loads(base64.b64decode(sys.stdin.buffer.read()))
    print(json.dumps({name: _traced(scene) for name, scene in scenes.items()}))


if __name__ == "__main__":
    _main()
