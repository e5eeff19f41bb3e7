"""
# A campaign on a cluster

A campaign simulates many trajectories and writes them to one file. This tutorial starts a Dask cluster on this machine,
which stands for any Dask cluster: only the address differs. This needs the extra `cluster`.
"""

# %%
# ## Start a cluster
#
# On a real one, `dask scheduler` and `dask worker` run on its machines, or `dask_jobqueue` asks SLURM for them, and the
# address is that of the scheduler.

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt
import numpy as np
from dask.distributed import LocalCluster

from bem import (
    Cases,
    LoadingProtocol,
    PronySeries,
    Scene,
    StandardLinearSolid,
    load_cases,
    run_campaign,
)

cluster = LocalCluster(
    n_workers=1,
    threads_per_worker=1,
    processes=False,
    protocol="tcp",
    dashboard_address=None,
)

# %%
# ## Any scenes and protocols
#
# `Cases` takes pairs of a scene and a protocol. Three solids, from one relaxation time to three, are pulled off at
# twelve rates.

solids = {
    "one relaxation time": StandardLinearSolid(modulus_ratio=0.1),
    "two relaxation times": PronySeries([0.45, 0.45], times=[0.1, 1.0]),
    "three relaxation times": PronySeries([0.3, 0.3, 0.3], times=[0.01, 0.1, 1.0]),
}
rates = np.logspace(-1, 3, 12)
pairs = [
    (
        Scene(tabor=1.0, material=solid),
        LoadingProtocol(
            peak_indentation=10.0,
            loading_rate=10.0,
            dwell_time=3.0,
            unloading_rate=float(rate),
        ),
    )
    for solid in solids.values()
    for rate in rates
]
out = Path(mkdtemp()) / "rates.h5"
cases = Cases(pairs, accuracy="draft")
summary = run_campaign(cases, out, cluster=cluster.scheduler_address)
failed = sum(summary.failures.values())
print(f"{summary.computed} of {summary.count} computed, {failed} failed")

# %%
# ## Continue it
#
# The same call continues after an interruption, and computes nothing that is already in the file: here, nothing at all.
# A case that fails becomes a row with its reason; `retry_failed=True` tries it again.

summary = run_campaign(cases, out, cluster=cluster.scheduler_address)
print(f"{summary.computed} of {summary.count} computed")
cluster.close()

# %%
# ## Read the file
#
# Every case holds its scene, its protocol and the whole trajectory.

pull_off = np.array([case.trajectory.pull_off_force for case in load_cases(out)])
pull_off = pull_off.reshape(len(solids), len(rates))

figure, axes = plt.subplots(figsize=(6.0, 3.8), layout="constrained")
for name, forces in zip(solids, pull_off, strict=True):
    axes.semilogx(rates, forces, "o-", label=name)
axes.set(
    xlabel=r"unloading rate ($h_0$ per retardation time)",
    ylabel=r"pull-off force ($\pi R\Delta\gamma$)",
)
axes.legend(frameon=False)
plt.show()

# %%
# On the command line, `bem campaign --cluster ADDRESS` gives the protocols of a design to a cluster, and [Generate data
# on a cluster](../cluster.md) says how far that scales.
