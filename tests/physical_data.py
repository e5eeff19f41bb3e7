"""A data set on physical steps that needs no solver."""

import numpy as np

from bem.dataset.designs import Design
from bem.dataset.physical_steps import physical_grid
from surrogate.data.dataset import TrajectoryDataset
from surrogate.data.features import channels


def physical_dataset(count: int) -> TrajectoryDataset:
    """Any forces that depend on the inputs and have a peak."""
    protocols = Design("sobol", modulus_ratio=(0.01, 1.0)).protocols(count, seed=0)
    times, indentations = physical_grid(**protocols)
    solids = {name: protocols[name] for name in ("tabor", "modulus_ratio")}
    force = 2.0 + channels(times, indentations, 0 * times, "F", **solids)[..., 6] / 1e3
    return TrajectoryDataset(
        protocols=protocols,
        force=force,
        points_per_phase=(22, 8, 72),
        scalars={
            "pull_off_force": force[:, 29:].max(axis=1),
            "pull_off_time": times[np.arange(count), 29 + force[:, 29:].argmax(axis=1)] + 1e-9,
            "hysteresis": np.ones(count),
        },
        status=np.zeros(count, dtype=np.uint8),
        sha256="0" * 64,
        forces_sha256="0" * 64,
        modulus_ratio=None,
        steps="physical",
    )
