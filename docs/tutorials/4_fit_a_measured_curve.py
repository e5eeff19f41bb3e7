"""
# Fit a measured curve

From the file of an indenter, in newtons and metres, to a modulus that says how far it may be trusted.

The curve is a real one: a polystyrene bead of 37 um on a soft cantilever, pressed into the spinal cord of a zebrafish
and withdrawn. It was measured for Moellmert et al. (Biophys. J. 118, 2020, 448) and is published with the package
afmformats under the MIT licence, whose text is `examples/measured_tissue.LICENSE` of the repository. A second curve,
whose answer is known, shows then how near a fit comes.
"""

# mkdocs_gallery_thumbnail_number = 2

# %%
# ## Read it
#
# The columns name their units. Compression is positive, and a file that contradicts it is refused. `contact`
# estimates the baseline, its noise, and the contact point as the place where the force leaves the baseline. The fits
# below refine them.

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import bem
from bem import StandardLinearSolid
from bem.lab import ForceCurve, Setup, fit
from bem.lab.fitting import guess_setup
from bem.lab.units import readable

file = Path(bem.__file__).parents[1] / "examples" / "measured_tissue.csv"
tissue = ForceCurve.read(file, stiffness="0.010951 N/m")
contact = tissue.contact()
print("contact point", readable(contact.contact_point, "m"))
print("noise        ", readable(contact.noise, "N"))
tissue

# %%
# ## Hertz on the approach
#
# This is what a laboratory does first. The authors' own program, nanite, finds 57.6 Pa for this curve. Where the model
# does not describe the curve, an interval would be a promise, and the fit gives none.

start = guess_setup(tissue, radius="18.64 um")
hertz = fit(tissue, start, model="hertz", segment="approach")
print(hertz.summary())

# %%
# ## The whole curve
#
# The models are tried as far as the curve calls for, here to the contact with adhesion and relaxation. The
# summary shows those tried, and says that no model is adequate. The tissue is felt before it carries load, and threads
# of it hold on after the contact has opened. No half-space does either.

result = fit(tissue, start)
print(result.summary())

figure, (above, below) = plt.subplots(1, 2, figsize=(8.0, 3.6), layout="constrained")
for axes, x, label in (
    (above, tissue.time, "time (s)"),
    (below, 1e6 * tissue.indentation, "path (um)"),
):
    axes.plot(x, 1e9 * tissue.force, ".", markersize=2, label="measured")
    axes.plot(x, 1e9 * result.curve.force, label="fitted")
    axes.set(xlabel=label, ylabel="force (nN), compression positive")
above.legend(frameon=False)
plt.show()

# %%
# ## A curve whose answer is known
#
# A tip of 20 nm on a polymer that relaxes, simulated with noise, another zero of the position, and an offset of the
# force.

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
noise = np.random.default_rng(1).normal(0.0, 0.01 * np.ptp(ideal.force), times.size)
curve = ForceCurve(
    time=times,
    indentation=np.interp(times, ideal.time, ideal.indentation) + 5e-10,
    force=np.interp(times, ideal.time, ideal.force) + noise + 5e-10,
    force_sign="compression",
)

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
# The interval of each parameter beside the value with which the curve was made:

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
