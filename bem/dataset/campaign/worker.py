"""What a worker has loaded before its first trajectory."""

import functools
import gc
from collections.abc import Callable
from typing import Any

from bem.materials import StandardLinearSolid
from bem.protocol import LoadingProtocol
from bem.scene import Scene

Solver = Callable[..., Any]

own_process = False
"""Whether this is a worker of `LocalExecutor`, in which nothing runs but what that gives it."""


@functools.cache
def warm_solver() -> Solver:
    """The solver with its kernels loaded, so that no trajectory is charged for that."""
    from bem._numerics.jit import leave_out_blas
    from bem.solver.simulation import simulate

    if own_process:
        leave_out_blas()
    protocol = LoadingProtocol(peak_indentation=2.0, loading_rate=10.0, dwell_time=0.1, unloading_rate=10.0)
    simulate(Scene(tabor=1.0, material=StandardLinearSolid(0.1)), protocol, "draft")
    if own_process:
        # Where psutil is missing, loky collects garbage every second; what is loaded here is none.
        gc.freeze()
    return simulate
