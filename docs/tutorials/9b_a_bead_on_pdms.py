"""
# A bead on PDMS

A glass bead of a millimetre on silicone rubber has a Tabor parameter of thousands. The contact is huge beside the range
of the attraction, and its edge is a sharp crack. How hard does the rubber hold it, from very slow to very fast?
"""

# %%
# ## The setup
#
# The library has the modulus of Sylgard 184. Its relaxation was not measured there. This tutorial assumes a standard
# linear solid: ten times stiffer when fast, with a retardation time of a microsecond. Measure your own batch.

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import EngFormatter

from bem import StandardLinearSolid, materials_library
from bem.lab import Setup
from bem.methods.closed_forms import jkr, persson_brener

pdms = materials_library.load("sylgard_184_cured_at_100c")
ratio = 0.1
bead = Setup(
    radius="1 mm",
    work_of_adhesion="50 mJ/m^2",
    relaxed_modulus=pdms.relaxed_modulus,
    poisson_ratio=pdms.poisson_ratio,
    retardation_time="1 us",
    material=StandardLinearSolid(ratio),
)
weight = np.pi * bead.radius * bead.work_of_adhesion
print(f"Tabor parameter {bead.tabor:.0f}")
print(f"pull-off force of JKR {1e6 * jkr.PULL_OFF_FORCE * weight:.0f} µN")

# %%
# ## Pull-off against speed, over six decades
#
# The bead is pressed in by 10 µm, rests for a second and is pulled off. `simulate` answers with the method for sharp
# cracks, whose expected error is `accuracy`.

speeds = np.geomspace(1e-8, 1e-2, 19)
curves = []
for speed in speeds:
    path = bead.protocol(
        peak_indentation="10 um",
        loading_rate="10 um/s",
        dwell_time="1 s",
        unloading_rate=speed,
        start_indentation="-30 um",
    )
    curves.append(bead.simulate(path))
forces = np.array([curve.pull_off_force for curve in curves])
worst = max(curve.accuracy for curve in curves)
print(f"from {1e6 * forces[0]:.0f} to {1e6 * forces[-1]:.0f} µN")
print(f"each is expected to err by {100 * worst:.1f} % at most")

# %%
# ## Beside closed forms
#
# Johnson, Kendall and Roberts know no speed. Persson and Brener give the work that a crack takes at its speed. That
# speed is the one of the edge where the force is largest; a pull-off then takes 3/2 of it.


def edge_speed(curve):
    """Speed of the contact edge at pull-off, in m/s."""
    top = np.argmax(curve.tension)
    radius, time = curve.contact_radius[: top + 1], curve.time[: top + 1]
    closing = radius > 1.02 * radius[-1]
    return (radius[closing][-1] - radius[-1]) / (time[-1] - time[closing][-1])


length = bead.gap * persson_brener.length_scale(
    bead.tabor, radius_over_gap=bead.radius / bead.gap
)
crack_speeds = np.array([edge_speed(curve) for curve in curves])
energy = persson_brener.effective_energy(
    crack_speeds * bead.retardation_time / length, ratio
)
closed = jkr.PULL_OFF_FORCE * weight * energy
most = 100.0 * np.abs(closed / forces - 1.0).max()
print(f"Persson and Brener differ by {most:.0f} % at most")

figure, axes = plt.subplots(figsize=(5.5, 3.6), layout="constrained")
axes.loglog(speeds, forces, "o-", label="simulated")
axes.loglog(speeds, closed, "--", label="Persson and Brener")
axes.axhline(
    jkr.PULL_OFF_FORCE * weight,
    color="0.5",
    linestyle=":",
    label="Johnson, Kendall and Roberts",
)
axes.set(xlabel="speed of retraction", ylabel="pull-off force")
axes.xaxis.set_major_formatter(EngFormatter("m/s"))
axes.set_yticks([2.5e-4, 5e-4, 1e-3, 2e-3])
axes.yaxis.set_major_formatter(EngFormatter("N"))
axes.yaxis.set_minor_formatter("")
axes.legend(frameon=False)
plt.show()
