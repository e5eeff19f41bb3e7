"""
# Design a release

How must a sphere be retracted so that it lets go at a wanted force? The surrogate predicts thousands of protocols in
seconds. This gives a map of all answers, and the gradient that leads to one of them; the solver then checks it.
"""

# %%
# ## A map of all answers
#
# Two quantities can be chosen, the unloading rate and the dwell time. The published surrogate `accurate` predicts the
# pull-off force over both. The solver computes it too, on fewer protocols, to see whether the map can be trusted.

import matplotlib.pyplot as plt
import numpy as np

import surrogate
from bem import LoadingProtocol, Scene, StandardLinearSolid, simulate

TABOR, WANTED = 2.0, 5.0
scene = Scene(TABOR, StandardLinearSolid(0.1))
model = surrogate.load("accurate")


def release(rate, dwell):
    """The protocol of a release; the approach is given."""
    return LoadingProtocol(
        peak_indentation=10.0,
        loading_rate=10.0,
        dwell_time=float(dwell),
        unloading_rate=float(rate),
    )


rates, dwells = np.logspace(-1, 3, 41), np.logspace(-2.5, 0.4, 15)
protocols = [release(rate, dwell) for dwell in dwells for rate in rates]
predicted = np.array(
    [found.pull_off_force for found in model.predict(scene, protocols)]
)
predicted = predicted.reshape(len(dwells), len(rates))
simulated = [
    [simulate(scene, release(rate, dwell)).pull_off_force for rate in rates[::2]]
    for dwell in dwells[::2]
]

figure, axes = plt.subplots(figsize=(6.0, 4.0), layout="constrained")
filled = axes.contourf(rates, dwells, predicted, levels=np.arange(1.0, 12.0, 1.0))
axes.contour(rates, dwells, predicted, levels=[WANTED], colors="w", linewidths=2.5)
axes.contour(
    rates[::2], dwells[::2], simulated, levels=[WANTED], colors="k", linestyles="--"
)
axes.set(
    xscale="log",
    yscale="log",
    xlabel=r"unloading rate ($h_0$ per retardation time)",
    ylabel="dwell time (retardation times)",
)
figure.colorbar(filled, label=r"pull-off force ($\pi R\Delta\gamma$)")
plt.show()

# %%
# On the white line the pull-off force is the one wanted; the dashed line is the solver's. The dwell matters little once
# the contact has relaxed.
#
# ## Follow the gradient
#
# With a gradient no map is needed. Finite differences in a batch of five predictions give the slopes by the logarithms
# of both quantities. SciPy minimises the error, with a small penalty on fast retraction and long dwell.

from scipy.optimize import minimize

STEP = 0.1
low, high = np.log([0.1, 1e-3]), np.log([1000.0, 3.0])


def cost_and_slope(logarithms):
    """Squared logarithm of the error plus the penalty, and the gradient of the sum."""
    points = logarithms + STEP * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
    protocols = [release(*np.exp(point)) for point in np.clip(points, low, high)]
    found = model.predict(scene, protocols)
    error = np.log([one.pull_off_force / WANTED for one in found])
    cost = error**2 + 1e-3 * points.sum(axis=1)
    return cost[0], np.array([cost[1] - cost[2], cost[3] - cost[4]]) / (2.0 * STEP)


start = np.log([20.0, 0.3])
bounds = np.column_stack([low, high])
best = minimize(cost_and_slope, start, jac=True, method="L-BFGS-B", bounds=bounds)
rate, dwell = np.exp(best.x)
print(f"unloading rate {rate:.4g}, dwell time {dwell:.4g}")
print(f"after {best.nfev} batches of five predictions")

# %%
# `examples/design_unloading.py` does the same with exact gradients, by differentiating the Keras model, from twelve
# starts at once.
#
# ## Check it with the solver
#
# The surrogate errs by some tenths of a percent. A few simulations correct the rate.

from scipy.optimize import root_scalar

tried = []


def excess(log_rate):
    """Pull-off force of the solver minus the wanted one."""
    rate = np.exp(log_rate)
    force = simulate(scene, release(rate, dwell)).pull_off_force
    tried.append((rate, force))
    return force - WANTED


root_scalar(excess, x0=np.log(rate), x1=np.log(rate) + 0.05, xtol=1e-3)
for tried_rate, force in tried:
    print(f"rate {tried_rate:.4f}: the solver finds a pull-off force of {force:.4f}")
