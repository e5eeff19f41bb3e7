"""
# First trajectory

Press a rigid sphere into a soft adhesive half-space, hold it, and pull it off. You describe the contact and the motion;
the solver returns the force at every instant.
"""

# mkdocs_gallery_thumbnail_path = "images/contact.png"

# %%
# ## Describe and simulate
#
# A `Scene` states what is in contact. Here the solid relaxes to a tenth of its instantaneous modulus (a standard linear
# solid), and the surfaces attract each other by the Lennard-Jones law. A protocol states how the sphere moves: in,
# dwell, out. All quantities are dimensionless: indentation in the equilibrium gap $h_0$, time in retardation times,
# force in $\pi R\Delta\gamma$. Tension is positive.

from bem import LennardJones, LoadingProtocol, Scene, StandardLinearSolid, simulate

scene = Scene(
    tabor=1.0,
    material=StandardLinearSolid(modulus_ratio=0.1),
    adhesion=LennardJones(),
)
protocol = LoadingProtocol(
    peak_indentation=20.0, loading_rate=10.0, dwell_time=1.0, unloading_rate=10.0
)
trajectory = simulate(scene, protocol)
trajectory

# %%
# A notebook shows a trajectory as a picture with its results; `trajectory.plot()` returns the same figure. During
# loading the force is compressive, during the dwell it relaxes, and during unloading it becomes tensile until the
# contact is pulled off.
#
# ## Read numbers from it
#
# The force is known at every instant, not only at the steps of the solver.

print("status         ", trajectory.status)
print("pull-off force ", round(trajectory.pull_off_force, 3))
print("pull-off time  ", round(trajectory.pull_off_time, 3))
print("hysteresis     ", round(trajectory.hysteresis, 2))
print("detached       ", trajectory.detached)
print("force at 0.5, 1", trajectory.at([0.5, 1.0]).round(3))

# %%
# The records are also a table, with units in its attributes.

table = trajectory.to_dataframe()
table.iloc[::40]

# %%
# ## How fast is fast?
#
# A viscoelastic contact resists a fast retraction with more force. A loop over unloading rates shows it.

import matplotlib.pyplot as plt
import numpy as np

rates = np.logspace(-2, 3, 11)
pull_off = []
for rate in rates:
    path = LoadingProtocol(
        peak_indentation=20.0,
        loading_rate=10.0,
        dwell_time=1.0,
        unloading_rate=float(rate),
    )
    pull_off.append(simulate(scene, path).pull_off_force)

figure, axes = plt.subplots(figsize=(5.5, 3.6), layout="constrained")
axes.semilogx(rates, pull_off, "o-")
axes.set(
    xlabel=r"unloading rate ($h_0$ per retardation time)",
    ylabel=r"pull-off force ($\pi R\Delta\gamma$)",
)
plt.show()

# %%
# ## What accuracy costs
#
# `accuracy` is a target for the relative error: a name or a number. The work grows as the target falls.

for accuracy in ("draft", "standard", "reference"):
    found = simulate(scene, protocol, accuracy)
    work = found.stats
    print(
        f"{accuracy:10} pull-off {found.pull_off_force:.4f}",
        f"{work.steps:5} steps {work.nodes:5.0f} nodes",
    )
