"""
# Cycles and creep

A protocol need not be one approach and one retraction. This tutorial takes a sphere through cycles, lets it creep under
a constant force, and compares the creep with a closed form.
"""

# %%
# ## Cycles
#
# `PiecewiseLinearProtocol` takes any history of the indentation that is linear between instants. The second and the
# third cycle do not repeat the first: the solid still remembers what happened before.

import matplotlib.pyplot as plt
import numpy as np

from bem import (
    ForceProtocol,
    HardContact,
    PiecewiseLinearProtocol,
    Scene,
    StandardLinearSolid,
    simulate,
)
from bem.results.plots import COLOURS
from bem.methods.closed_forms import hertz

solid = StandardLinearSolid(modulus_ratio=0.1)
times = np.arange(7) * 0.8
cycles = PiecewiseLinearProtocol(
    times=times, indentations=[-2.1, 8.0, -2.1, 8.0, -2.1, 8.0, -2.1]
)
trajectory = simulate(Scene(tabor=1.0, material=solid), cycles)

figure, (history, loop) = plt.subplots(
    1, 2, figsize=(9.0, 3.6), sharey=True, layout="constrained"
)
history.plot(trajectory.time, trajectory.force)
history.set(xlabel="time (retardation times)", ylabel=r"force ($\pi R\Delta\gamma$)")
for number, line in enumerate(("-", "-", "--")):
    begin, end = times[2 * number], times[2 * number + 2]
    cycle = (trajectory.time >= begin) & (trajectory.time <= end)
    indentation, force = trajectory.indentation[cycle], trajectory.force[cycle]
    loop.plot(indentation, force, line, label=f"cycle {number + 1}")
loop.set_xlabel(r"indentation ($h_0$)")
loop.legend(frameon=False)
plt.show()

# %%
# Each cycle dissipates energy, the area of its loop. Tension is positive, so that the work done on the contact is
# $-\int P\,d\delta$.

for number in range(3):
    begin, end = times[2 * number], times[2 * number + 2]
    cycle = (trajectory.time >= begin) & (trajectory.time <= end)
    force = trajectory.force[cycle]
    work = -np.trapezoid(force, trajectory.indentation[cycle])
    print(f"cycle {number + 1}: work {work:.2f}, largest tension {force.max():.2f}")

# %%
# ## Creep under a constant force
#
# `ForceProtocol` prescribes the force, tension positive. Here a sphere without adhesion carries a compression of 5 from
# the time 0.001 on. Lee and Radok's solution gives the indentation while the contact grows: $\delta^{3/2}$ follows
# the creep compliance $C(t) = 1 - (1-k)e^{-t}$.

creep = simulate(
    Scene(tabor=1.0, material=solid, adhesion=HardContact()),
    ForceProtocol(times=[0.0, 1e-3, 6.0], forces=[0.0, -5.0, -5.0]),
)
held = creep.time >= 1e-3
travel = creep.indentation[held]
# The depth at which the relaxed solid carries the load, by Hertz.
relaxed = (-5.0 / hertz.force_from_indentation(1.0, 1.0)) ** (2.0 / 3.0)
# The load grew over the first thousandth: on average it came half of that earlier.
since = creep.time[held] - 5e-4
closed_form = relaxed * (1.0 - 0.9 * np.exp(-since)) ** (2.0 / 3.0)

figure, axes = plt.subplots(figsize=(5.5, 3.6), layout="constrained")
axes.plot(creep.time[held], travel, color=COLOURS["solver"], label="simulated")
theory = {"color": COLOURS["closed form"], "linestyle": "--", "linewidth": 2.5}
axes.plot(creep.time[held], closed_form, **theory, label="Lee and Radok")
axes.set(xlabel="time (retardation times)", ylabel=r"indentation ($h_0$)")
axes.legend(frameon=False)
plt.show()
difference = np.max(np.abs(travel / closed_form - 1.0))
print(f"largest difference {difference:.1e} of the indentation")

# %%
# ## Adhesion under force control
#
# The same load on an adhesive sphere, then a growing tension. Where the contact cannot carry the tension, the sphere
# flies off, and the status of the trajectory says so.

path = ForceProtocol(times=[0.0, 0.1, 2.0, 3.0], forces=[0.0, -5.0, -5.0, 8.0])
pulled = simulate(Scene(tabor=1.0, material=solid), path)
print(pulled.status)
pulled
