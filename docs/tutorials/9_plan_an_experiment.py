"""
# Plan an experiment

Three questions come before the first measurement: how fast to retract, how long to wait, and what the cantilever will
do to the curve. The answers are in newtons and seconds.
"""

# %%
# ## How fast must I retract to hold 5 mN, and to let go below 1 mN?
#
# A glass lens sits on a soft viscoelastic solid. Pulled fast, it holds more than it would at rest, because the edge of
# the contact dissipates. `Setup` takes the experiment in SI units; `simulate` returns the force curve in newtons.

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import EngFormatter

from bem import Elastic, StandardLinearSolid
from bem.lab import Setup

lens = Setup(
    radius=3.5e-3,
    work_of_adhesion=0.05,
    relaxed_modulus=2e6,
    retardation_time=1e-6,
    material=StandardLinearSolid(modulus_ratio=0.1),
)


def pull_off_force(setup, depth, approach, dwell, retraction):
    """Pull-off force in N; depth in m, speeds in m/s, dwell in s."""
    protocol = setup.protocol(
        peak_indentation=depth,
        loading_rate=approach,
        dwell_time=dwell,
        unloading_rate=retraction,
        start_indentation=-3.0 * depth,
    )
    return setup.simulate(protocol, "draft").pull_off_force


speeds = np.geomspace(1e-8, 1e-2, 25)
forces = np.array([pull_off_force(lens, 1e-5, 1e-5, 1.0, speed) for speed in speeds])
wanted = np.log([1e-3, 5e-3])
let_go, hold = np.exp(np.interp(wanted, np.log(forces), np.log(speeds)))
print(f"retract slower than {1e9 * let_go:.0f} nm/s to let go")
print(f"retract faster than {1e6 * hold:.0f} µm/s to hold")

figure, axes = plt.subplots(figsize=(5.5, 3.6), layout="constrained")
axes.loglog(speeds, forces)
axes.plot([let_go, hold], [1e-3, 5e-3], "o")
axes.set(xlabel="speed of retraction", ylabel="pull-off force")
axes.set_yticks([1e-3, 2e-3, 5e-3])
axes.yaxis.set_minor_formatter("")
axes.xaxis.set_major_formatter(EngFormatter("m/s"))
axes.yaxis.set_major_formatter(EngFormatter("N"))
plt.show()

# %%
# Both speeds grow with the range of adhesion, `lens.equilibrium_gap`, and fall with the retardation time. The edge
# dissipates where it crosses that range within about this time.
#
# ## How long must I wait for the approach not to matter?
#
# A fast approach leaves the contact of a small bead smaller than it will become, and a retraction that follows at once
# measures less adhesion. During the dwell the contact grows, and the memory fades. This solid relaxes more slowly.

bead = lens.replaced(radius=50e-6, retardation_time=0.1)
dwells = np.geomspace(1e-3, 3.0, 12)
approaches = (2e-7, 2e-6, 2e-5, 2e-4)
measured = np.array(
    [
        [pull_off_force(bead, 5e-7, speed, dwell, 2e-5) for speed in approaches]
        for dwell in dwells
    ]
)
spread = 100.0 * np.ptp(measured, axis=1) / measured.mean(axis=1)
enough = dwells[np.flatnonzero(spread > 2.0)[-1] + 1]
print(f"after {dwells[0]:g} s the approaches differ by {spread[0]:.0f} %")
print(f"from {enough:.2g} s on they differ by less than 2 %")

figure, axes = plt.subplots(figsize=(5.5, 3.6), layout="constrained")
for approach, column in zip(approaches, measured.T, strict=True):
    axes.semilogx(dwells, column, ".-", label=f"{EngFormatter('m/s')(approach)}")
axes.set(xlabel="dwell", ylabel="pull-off force")
axes.xaxis.set_major_formatter(EngFormatter("s"))
axes.yaxis.set_major_formatter(EngFormatter("N"))
axes.legend(title="approach at", frameon=False)
plt.show()

# %%
# ## What does my cantilever do to the measured pull-off?
#
# The tip of an atomic force microscope sits on a cantilever, a spring. A soft one jumps into and out of
# contact. The elastic pull-off force does not depend on the spring; that of a viscoelastic solid does, since a
# stretched cantilever keeps pulling.

tip = Setup(
    radius=20e-9,
    work_of_adhesion=0.05,
    relaxed_modulus=1e9,
    poisson_ratio=0.35,
    retardation_time=0.01,
)
figure, panels = plt.subplots(1, 2, figsize=(8, 3.6), layout="constrained", sharey=True)
solids = {"elastic": Elastic(), "viscoelastic": StandardLinearSolid(modulus_ratio=0.3)}
for axes, (name, material) in zip(panels, solids.items(), strict=True):
    for stiffness in (0.5, 3.0, None):
        setup = tip.replaced(material=material, stiffness=stiffness)
        path = setup.protocol(
            peak_indentation=3e-9,
            loading_rate=2e-7,
            unloading_rate=2e-7,
            start_indentation=-2.5e-8,
        )
        curve = setup.simulate(path, "draft")
        moved = curve.indentation if curve.stage is None else curve.stage
        label = "rigid" if stiffness is None else f"{stiffness:g} N/m"
        axes.plot(moved, curve.force, label=label)
    axes.set(title=name, xlabel="displacement of the stage", ylim=(-1.2e-8, 1.3e-8))
    axes.locator_params(axis="x", nbins=4)
    axes.xaxis.set_major_formatter(EngFormatter("m"))
    axes.yaxis.set_major_formatter(EngFormatter("N"))
panels[0].set_ylabel("force, tension positive")
panels[1].legend(frameon=False)
plt.show()
