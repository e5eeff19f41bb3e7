"""
# Infer a material

What is the material behind one noisy force curve, and how well is it known? Bayes' rule answers with a probability of
every material, and needs the force curves of thousands of them. A pretrained surrogate predicts these in seconds, and a
few hundred simulations tell how far it can be trusted.
"""

# mkdocs_gallery_thumbnail_number = 3

# %%
# ## The experiment
#
# A sphere is pressed in by $15\,h_0$, held, and pulled off. Radius, work of adhesion and the equilibrium gap $h_0$ are
# known. Tabor parameter, modulus ratio and retardation time are not. The solver makes the curve, with 1 % noise.

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import least_squares
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, multivariate_t

import surrogate
from bem import LoadingProtocol, Scene, StandardLinearSolid, simulate
from bem.problem.protocol import default_start_indentation

TRUE = {"tabor": 1.37, "modulus_ratio": 0.113, "retardation_time": 1.21}
PEAK, APPROACH, DWELL, RETRACTION = 15.0, 10.0, 0.5, 30.0  # h0, h0/s, s, h0/s
instants = np.linspace(0.0, 2.55, 201)[1:]  # s, from the first touch


def protocol(retardation_time):
    """The experiment in the units of the solver, whose time is the retardation time."""
    return LoadingProtocol(
        peak_indentation=PEAK,
        loading_rate=APPROACH * retardation_time,
        dwell_time=DWELL / retardation_time,
        unloading_rate=RETRACTION * retardation_time,
    )


def recorded(found, tabor, retardation_time):
    """Force at the instants of the record; a history begins before the touch."""
    touch = -default_start_indentation(tabor) / (APPROACH * retardation_time)
    return found.at(touch + instants / retardation_time)


def solved(logarithms, accuracy="standard"):
    """Force curves of the solver for logarithms of parameters."""
    rows = []
    for tabor, ratio, time in np.exp(logarithms).tolist():
        found = simulate(
            Scene(tabor, StandardLinearSolid(ratio)), protocol(time), accuracy
        )
        rows.append(recorded(found, tabor, time))
    return np.array(rows)


(force,) = solved(np.log([list(TRUE.values())]), "reference")
noise = 0.01 * np.ptp(force)
measured = force + noise * np.random.default_rng(0).standard_normal(force.size)

figure, axes = plt.subplots(figsize=(6.0, 3.0), layout="constrained")
axes.plot(instants, measured, ".", markersize=3)
axes.set(xlabel="time (s)", ylabel=r"force ($\pi R\Delta\gamma$)")
plt.show()

# %%
# ## The surrogate
#
# `fast` knows any linear solid. Before the measurement, the logarithms of the parameters are uniform between
# bounds.

fast = surrogate.load("fast")
prior = {
    "tabor": (0.8, 3.2),
    "modulus_ratio": (0.02, 0.5),
    "retardation_time": (0.2, 5.0),
}


def predicted(logarithms, model=fast):
    """Force curves of a surrogate for logarithms of parameters."""
    tabor, ratio, times = np.exp(logarithms).T
    solids = map(StandardLinearSolid, ratio.tolist())
    scenes = [Scene(*pair) for pair in zip(tabor.tolist(), solids, strict=True)]
    found = model.predict(scenes, [protocol(time) for time in times.tolist()])
    rows = zip(found, tabor.tolist(), times.tolist(), strict=True)
    return np.array([recorded(*row) for row in rows])


# %%
# ## Downhill, by derivatives
#
# One answer without its probability takes a few steps of least squares from the middle of the bounds. `accurate` gives
# the derivatives of the whole curve: six predictions in one batch, each parameter a little less and a little more.

accurate = surrogate.load("accurate")
STEP = 0.02


def misfit(logarithms):
    """Prediction less measurement, over the noise."""
    return (predicted(logarithms[np.newaxis], accurate)[0] - measured) / noise


def slopes(logarithms):
    """Derivatives of the misfit, (instants, parameters)."""
    moved = np.concatenate([-np.eye(3), np.eye(3)]) * STEP + logarithms
    less, more = predicted(moved, accurate).reshape(2, 3, -1)
    return (more - less).T / (2.0 * STEP * noise)


bounds = np.log(list(prior.values())).T
downhill = least_squares(misfit, bounds.mean(axis=0), jac=slopes, bounds=bounds)
print(f"{downhill.nfev} predictions and {downhill.njev} derivatives:")
print(dict(zip(TRUE, np.exp(downhill.x).round(4).tolist(), strict=True)))

# %%
# ## The surrogate's own error
#
# Near the answer the posterior is nearly Gaussian, with the covariance that the derivatives give. Materials are drawn
# from a Student distribution twice as wide. Simulations of some of them show by how much `fast` is off, compared with
# the noise. Mean and covariance of this error become a part of the likelihood.

covariance = np.linalg.inv(downhill.jac.T @ downhill.jac)
near = multivariate_t(downhill.x, 4.0 * covariance, df=6)


def drawn(count, seed):
    """Draw logarithms of parameters near the answer, within the bounds."""
    points = near.rvs(count, random_state=seed)
    return points[np.all((points >= bounds[0]) & (points <= bounds[1]), axis=1)]


some = drawn(128, seed=1)
errors = solved(some) - predicted(some)

figure, axes = plt.subplots(figsize=(6.0, 3.0), layout="constrained")
axes.plot(instants, errors.T, color="0.7", linewidth=0.5)
axes.fill_between(instants, -noise, noise, alpha=0.3, label="noise")
axes.set(xlabel="time (s)", ylabel=r"error of the surrogate ($\pi R\Delta\gamma$)")
axes.legend(frameon=False)
plt.show()

# %%
# ## The posterior
#
# Twenty thousand materials are drawn, each with a weight: its likelihood over the density that it is drawn from. They
# are as good as a smaller number of equal weight.

spread = noise**2 * np.eye(measured.size) + np.cov(errors, rowvar=False)
likelihood = multivariate_normal(measured - errors.mean(axis=0), spread)
points = drawn(20_000, seed=2)
curves = np.concatenate([predicted(part) for part in np.array_split(points, 20)])
logarithms = likelihood.logpdf(curves) - near.logpdf(points)
weights = np.exp(logarithms - logsumexp(logarithms))
equal = 1.0 / np.sum(weights**2)
print(f"{len(points)} samples, as good as {equal:.0f} of equal weight")

values = np.exp(points)
weighted = {"weights": weights, "method": "inverted_cdf"}
ends = np.quantile(values, [0.025, 0.975], axis=0, **weighted)
for number, (name, true) in enumerate(TRUE.items()):
    mean, (low, high) = weights @ values[:, number], ends[:, number]
    found = f"{mean:.4f}, 95 % interval {low:.4f} to {high:.4f}"
    print(f"{name:17} {found}, downhill {np.exp(downhill.x[number]):.4f}, true {true}")

figure, panels = plt.subplots(1, 2, figsize=(7.5, 3.2), layout="constrained")
columns = dict(zip(TRUE, values.T, strict=True))
edges = dict(
    zip(TRUE, np.quantile(values, [5e-4, 0.9995], axis=0, **weighted).T, strict=True)
)
labels = {
    "tabor": "Tabor parameter",
    "modulus_ratio": "modulus ratio",
    "retardation_time": "retardation time (s)",
}
offset = {"textcoords": "offset points"}
shown = (("tabor", "modulus_ratio"), ("modulus_ratio", "retardation_time"))
for axes, (x, y) in zip(panels, shown, strict=True):
    look = {"range": [edges[x], edges[y]], "weights": weights, "cmap": "Blues"}
    axes.hist2d(columns[x], columns[y], 24, **look)
    axes.plot(TRUE[x], TRUE[y], "r+", markersize=20, markeredgewidth=3)
    axes.annotate("true", (TRUE[x], TRUE[y]), (10, 8), color="r", size=14, **offset)
    axes.locator_params(nbins=5)
    axes.set(xlabel=labels[x], ylabel=labels[y])
plt.show()
