"""
# What each effect costs

A scene names its effects, and only these are computed. This tutorial follows one sphere along one path and adds an
effect at a time: adhesion, one relaxation process, ten of them, a spring. It then asks which effects the path calls
for.
"""

# %%
# ## One path, five scenes

import time

import matplotlib.pyplot as plt

from bem import (
    Elastic,
    HardContact,
    LennardJones,
    LoadingProtocol,
    PronySeries,
    Scene,
    StandardLinearSolid,
    recommend,
    simulate,
)

one = StandardLinearSolid(modulus_ratio=0.1)
ten = PronySeries(
    [0.09] * 10, [0.01, 0.03, 0.08, 0.2, 0.6, 1.7, 5.0, 13.0, 36.0, 100.0]
)
scenes = {
    "Hertz": Scene(1.0, Elastic(), HardContact()),
    "adhesion": Scene(1.0, Elastic(), LennardJones()),
    "one relaxation": Scene(1.0, one, LennardJones()),
    "ten relaxations": Scene(1.0, ten, LennardJones()),
    "and a spring": Scene(1.0, ten, LennardJones(), spring=2.0),
}
protocol = LoadingProtocol(
    peak_indentation=4.0,
    loading_rate=20.0,
    dwell_time=0.2,
    unloading_rate=20.0,
    start_indentation=-8.0,
)

figure, axes = plt.subplots(figsize=(6.5, 4.0), layout="constrained")
found = {}
for name, scene in scenes.items():
    trajectory = found[name] = simulate(scene, protocol)
    axes.plot(trajectory.time, trajectory.force, label=name)
axes.set(xlabel="time (retardation times)", ylabel=r"force ($\pi R\Delta\gamma$)")
axes.legend(frameon=False)
plt.show()

# %%
# ## Their cost
#
# `stats` counts what the solver did. The processor time is the smallest of five runs.


def milliseconds(scene):
    """Processor time of a simulation."""
    spent = []
    for _ in range(5):
        begin = time.process_time()
        simulate(scene, protocol)
        spent.append(time.process_time() - begin)
    return 1e3 * min(spent)


print("scene                ms  steps  nodes iterations  memory vectors")
for name, scene in scenes.items():
    work = found[name].stats
    print(
        f"{name:16} {milliseconds(scene):6.1f} {work.steps:6} {work.nodes:6.0f}",
        f"{work.iterations:10} {work.memory_vectors:15}",
    )

# %%
# Ten relaxation processes cost little more than one, because each adds one vector of memory. A jump behind a spring
# costs additional iterations.
#
# ## Which effects does a path call for?
#
# `recommend` returns the cheapest scene whose force stays within a tolerance of the full one, or, with
# `best="fewest"`, the scene with the fewest effects. A slow path needs no memory and a fast one meets a glassy solid;
# only between the two does relaxation matter.

for rate in (0.01, 20.0, 5000.0):
    path = LoadingProtocol(
        peak_indentation=4.0,
        loading_rate=rate,
        dwell_time=0.0,
        unloading_rate=rate,
        start_indentation=-3.0,
    )
    advice = recommend(Scene(1.0, one), path, tolerance=0.05, best="fewest")
    print(f"at rate {rate:g}: {advice.effects}")
