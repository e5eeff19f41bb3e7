"""The twelve canonical protocols: solver against surrogate, with the seconds of both.

The seconds are those that `experiments.measurements.canonical_times` measured and published.
Source: the paper's section "Canonical adhesion regimes" and its timing table.
"""

from typing import Any

import numpy as np

from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import FIRST_UNLOADING
from bem.results.profiles import moments
from experiments import common
from experiments.cases import Case, native
from experiments.common import Config, Models, Result
from experiments.paper_numbers import paper_rows
from experiments.published_models import by_recipe

PICTURED, PROFILES = 5, 400
"""Sample whose contact the graphical abstract shows, and profiles from which those at its moments are chosen."""
CLOSE = 5.0
"""Percent within which a pull-off force counts as in strong agreement, for which the paper states no number."""


def regime(
    protocol: dict[str, Any], surrogates: dict[str, Any], config: dict[str, Any], seconds: dict[str, float]
) -> dict[str, Any]:
    """One row of the timing table: native history, measurement steps, seconds; prediction and errors by recipe."""
    from surrogate.data.metrics import physical_errors

    case = Case.of(protocol, config["modulus_ratio"])
    trajectory = case.simulated(config["accuracy"])
    steps, by_recipe = case.on_steps(trajectory), {}
    times, indentations, reference = (steps[name][None] for name in ("time", "indentation", "force"))
    for recipe, trained in surrogates.items():
        force = common.predicted(trained, steps["time"], steps["indentation"], protocol["tabor"])
        errors = physical_errors(force[None], reference, times, indentations, FIRST_UNLOADING)
        percents = {name: float(errors[f"{name}_percent"][0]) for name in ("pull_off_force", "hysteresis", "nmae")}
        by_recipe[recipe] = {"force": force, "errors_percent": percents}
    return {
        "sample": int(protocol["sample"]),
        "protocol": {name: protocol[name] for name in QUANTITIES},
        "native": native(trajectory),
        "steps": steps,
        "predicted": by_recipe,
        "seconds": seconds,
        "paper_seconds": {"solver": protocol["bem_seconds"], "surrogate": protocol["surrogate_seconds"]},
    }


def contacts(protocol: dict[str, Any], config: dict[str, Any]) -> dict[str, Any]:
    """The contact at its moments, by their names: instant, force, and surface and sphere over the radius, in h0."""
    trajectory = Case.of(protocol, config["modulus_ratio"]).simulated(config["accuracy"], PROFILES)
    profiles, pictures = trajectory.profiles, {}
    assert profiles is not None
    for name, instant in moments(trajectory).items():
        i = int(np.argmin(np.abs(profiles.time - instant)))
        rows = {"radius": profiles.radius[i], "surface": -profiles.displacement[i], "sphere": profiles.sphere[i]}
        finite = np.isfinite(profiles.radius[i])
        pictures[name] = {key: values[finite] for key, values in rows.items()}
        pictures[name] |= {key: float(getattr(profiles, key)[i]) for key in ("time", "indentation", "force")}
    return pictures


def summary(regimes: list[dict[str, Any]]) -> dict[str, Any]:
    """Medians of the seconds over the twelve protocols, and for each recipe how many pull-off forces are close."""
    columns = {name: np.array([row["seconds"][name] for row in regimes]) for name in regimes[0]["seconds"]}
    medians = {f"median_{name}_seconds": float(np.median(values)) for name, values in columns.items()}
    ratio = {name: float(np.median(columns["solver"] / columns[name])) for name in ("keras_call", "predictor")}
    agreement = {}
    for recipe in regimes[0]["predicted"]:
        errors = [row["predicted"][recipe]["errors_percent"]["pull_off_force"] for row in regimes]
        agreement[recipe] = {"close": sum(error <= CLOSE for error in errors), "largest_percent": max(errors)}
    return {
        **medians,
        "orders_of_magnitude": float(np.log10(ratio["keras_call"])),
        "solver_faster_than_call": 1.0 / ratio["keras_call"],
        "orders_of_magnitude_by_predictor": float(np.log10(ratio["predictor"])),
        "agreement": agreement,
    }


def study(config: Config, models: Models, canonical_times: Result) -> dict[str, Any]:
    """Simulate and predict the twelve protocols."""
    labels = by_recipe(config["model"], models)
    surrogates = {recipe: common.load_surrogate(label, models) for recipe, label in labels.items()}
    rows = paper_rows("canonical_protocols")
    regimes = [
        regime(protocol, surrogates, config, canonical_times["seconds"][str(int(protocol["sample"]))])
        for protocol in rows
    ]
    return {
        "config": config,
        "times": {name: canonical_times[name] for name in ("host", "config")},
        "summary": summary(regimes),
        "regimes": regimes,
        "contacts": contacts(next(row for row in rows if int(row["sample"]) == PICTURED), config),
    }
