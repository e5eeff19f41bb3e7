"""
# Fit a measured curve

From a file of an indenter, in newtons and metres, to the modulus, the work of adhesion and their uncertainty.

A contact whose answer is known shows how near a fit comes. This tutorial first writes its file as an instrument would:
a simulated contact with noise, another zero of the position, and an offset of the force.
"""

# %%
# ## The file
#
# A tip of 20 nm on a polymer that relaxes. `bem.lab` takes and returns SI units.

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt
import numpy as np

from bem import StandardLinearSolid
from bem.lab import ForceCurve, Setup, fit
from bem.lab.units import readable

true = Setup(
    radius=20e-9,
    work_of_adhesion=0.05,
    relaxed_modulus=1e9,
    poisson_ratio=0.35,
    retardation_time=0.01,
    material=StandardLinearSolid(modulus_ratio=0.4),
)
protocol = true.protocol(
    peak_indentation=3e-9,
    loading_rate=1e-7,
    dwell_time=0.02,
    unloading_rate=1e-7,
    start_indentation=-4e-9,
)
ideal = true.simulate(protocol, force_sign="compression")

times = np.linspace(0.0, ideal.time[-1], 400)
position = np.interp(times, ideal.time, ideal.indentation) + 5e-10
noise = np.random.default_rng(1).normal(0.0, 0.01 * np.ptp(ideal.force), times.size)
force = np.interp(times, ideal.time, ideal.force) + noise + 5e-10
file = Path(mkdtemp()) / "curve.csv"
columns = np.column_stack([1e3 * times, 1e9 * position, 1e9 * force])
np.savetxt(
    file,
    columns,
    fmt="%.6g",
    delimiter=",",
    header="time (ms),indentation (nm),force (nN)",
    comments="",
)
print(*file.read_text().splitlines()[:3], sep="\n")

# %%
# ## Read it
#
# The columns name their units; the sign of the force is stated, and a file that contradicts it is refused. `contact`
# estimates the baseline, its noise, and the contact point as the place where the force leaves the baseline. The fit
# below refines them.

curve = ForceCurve.read(file, force_sign="compression")
contact = curve.contact()
print("contact point", readable(contact.contact_point, "m"))
print("force offset ", readable(contact.force_offset, "N"))
print("noise        ", readable(contact.noise, "N"))
curve

# %%
# ## Fit it
#
# The first guess is off by a third and more. Six parameters are free, the contact point and the offset of the force
# among them; every step of the fit is a simulation.

guess = Setup(
    radius=20e-9,
    work_of_adhesion=0.03,
    relaxed_modulus=6e8,
    poisson_ratio=0.35,
    retardation_time=0.02,
    material=StandardLinearSolid(modulus_ratio=0.6),
)
six = (
    "relaxed_modulus",
    "work_of_adhesion",
    "modulus_ratio",
    "retardation_time",
    "contact_point",
    "force_offset",
)
result = fit(curve, guess, free=six, accuracy="draft")
print(result.summary())

# %%
# ## Look at the residuals
#
# Residuals without structure say that the model describes the curve. The intervals are valid only then.

figure, (above, below) = plt.subplots(
    2, 1, figsize=(6.0, 5.0), sharex=True, layout="constrained", height_ratios=[3, 1]
)
above.plot(1e3 * curve.time, 1e9 * curve.force, ".", markersize=3, label="measured")
above.plot(1e3 * curve.time, 1e9 * result.curve.force, label="fitted")
above.set_ylabel("force (nN), compression positive")
above.legend(frameon=False)
below.plot(1e3 * curve.time, 1e9 * result.residuals, ".", markersize=3)
below.set(xlabel="time (ms)", ylabel="residual (nN)")
plt.show()

# %%
# The interval of each parameter beside the value with which the file was written:

truth = {
    "relaxed_modulus": 1e9,
    "work_of_adhesion": 0.05,
    "modulus_ratio": 0.4,
    "retardation_time": 0.01,
    "contact_point": 5e-10,
    "force_offset": 5e-10,
}
for name, value in truth.items():
    low, high = result.intervals[name]
    print(f"{name:17} {value:8.3g}, 95 % interval {low:9.4g} to {high:9.4g}")
