"""Pull-off amplification against crack velocity in the relaxed short-range limit: solver, surrogate and theory.

The paper assigns to each protocol a crack velocity from the table of another study. The solver measures its own: the
speed at which the contact edge retreats at pull-off, from a quadratic fit of `contact_radius` over time, in l0 over the
retardation time. beta / l0 = mu^2 pi alpha^2 / s^2 with s = 9 sqrt(3) / 16, independent of R / h0. The protocols lie
slightly above the range of Tabor parameters on which the model was trained. The study silences the warning about it,
and its summary gives the distance. Source: the paper's section on the relaxed short-range limit and its appendix on
protocol definitions.
"""

from typing import Any

import numpy as np

from bem import Trajectory
from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import FIRST_UNLOADING
from bem.methods.closed_forms import jkr
from bem.methods.closed_forms import persson_brener as theory
from experiments import common
from experiments.cases import Case
from experiments.common import Config, Models
from experiments.paper_numbers import paper_rows
from experiments.published_models import by_recipe

CURVE_POINTS = 200
FASTEST = 4
"""Points at the end of the table, whose crack velocities are some ten times those before."""
LARGE = 1e12
"""A crack velocity, in l0 over the retardation time, at which the theory has reached its upper limit."""


def edge_velocity(trajectory: Trajectory, within: float) -> float:
    """Speed of the retreating contact edge at pull-off, in beta over the retardation time.

    Args:
        trajectory: A completed trajectory.
        within: Largest distance of the fitted forces from the pull-off force, as a share of it.
    """
    peak = int(np.flatnonzero(trajectory.time == trajectory.pull_off_time)[0])
    near = trajectory.unloading & (trajectory.force >= (1.0 - within) * trajectory.pull_off_force)
    rows = np.flatnonzero(near)
    # Only the steps around the peak without a gap, and at least two steps before it.
    pieces = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    piece = next(candidate for candidate in pieces if candidate[0] <= peak <= candidate[-1])
    begin, end = min(piece[0], peak - 2), piece[-1]
    time, radius = (values[begin : end + 1] for values in (trajectory.time, trajectory.contact_radius))
    scale = max(time[-1] - time[0], 1e-300)
    slope = np.polyfit((time - trajectory.pull_off_time) / scale, radius, 2)[-2]
    return float(-slope / scale)


def point(protocol: dict[str, float], surrogates: dict[str, Any], config: dict[str, Any]) -> dict[str, Any]:
    """Amplifications and velocities of one protocol; of the surrogate by recipe."""
    ratio, tabor = config["modulus_ratio"], protocol["tabor"]
    case = Case.of(protocol, ratio)
    trajectory = case.simulated(config["accuracy"])
    forces = {recipe: common.predicted(trained, *case.grid(), tabor) for recipe, trained in surrogates.items()}
    own = edge_velocity(trajectory, config["fit_within"]) * theory.beta_over_length_scale(tabor)
    return {
        "point": int(protocol["point"]),
        "protocol": {name: protocol[name] for name in QUANTITIES},
        "unloading_rate": protocol["unloading_rate"],
        "crack_velocity": protocol["crack_velocity"],
        "own_crack_velocity": own,
        "theory": float(theory.effective_energy(protocol["crack_velocity"], ratio)),
        "theory_at_own_velocity": float(theory.effective_energy(own, ratio)),
        "solver": trajectory.pull_off_force / jkr.PULL_OFF_FORCE,
        **{recipe: float(force[FIRST_UNLOADING:].max()) / jkr.PULL_OFF_FORCE for recipe, force in forces.items()},
    }


def summary(points: list[dict[str, Any]]) -> dict[str, Any]:
    """Median and largest deviations, in percent; for surrogates also whether the largest is at the fastest cracks."""
    columns = {name: np.array([row[name] for row in points]) for name in points[0] if name != "protocol"}
    surrogates = [recipe for recipe in ("paper", "swift") if recipe in columns]
    deviations: dict[str, Any] = {}
    pairs = [("solver", "theory"), ("solver", "theory_at_own_velocity"), *((name, "theory") for name in surrogates)]
    for value, reference in pairs:
        deviation, name = 100.0 * np.abs(columns[value] / columns[reference] - 1.0), f"{value}_against_{reference}"
        deviations[f"{name}_median_percent"] = float(np.median(deviation))
        deviations[f"{name}_largest_percent"] = float(deviation.max())
        deviations[f"{name}_largest_when_fast"] = bool(deviation.argmax() >= len(points) - FASTEST)
    return deviations


def study(config: Config, models: Models) -> dict[str, Any]:
    """Simulate and predict the fourteen protocols, and evaluate the theory."""
    labels = by_recipe(config["model"], models)
    surrogates = {recipe: common.load_surrogate(label, models) for recipe, label in labels.items()}
    protocols = paper_rows("persson_brener_protocols")
    points = [point(protocol, surrogates, config) for protocol in protocols]
    velocities = np.array([row["crack_velocity"] for row in points])
    curve = np.geomspace(velocities.min() / 3.0, velocities.max() * 3.0, CURVE_POINTS)
    statistics = summary(points)
    highest = max(protocol["tabor"] for protocol in protocols)
    trained_up_to = next(iter(surrogates.values())).scaling.ranges["tabor"][1]
    # How far above the trained range, in percent of its upper end.
    statistics["extrapolation_percent"] = max(0.0, 100.0 * (highest / trained_up_to - 1.0))
    statistics["trained_up_to_tabor"] = trained_up_to
    limits = theory.effective_energy(np.array([0.0, LARGE]), config["modulus_ratio"])
    statistics |= dict(zip(("energy_at_rest", "energy_of_a_fast_crack"), limits.tolist(), strict=True))
    statistics["length_scale_over_gap"] = float(theory.length_scale(protocols[0]["tabor"]))
    energies = theory.effective_energy(curve, config["modulus_ratio"])
    return {
        "config": config,
        "summary": statistics,
        "points": points,
        "theory": {"crack_velocity": curve.tolist(), "effective_energy": energies.tolist()},
    }
