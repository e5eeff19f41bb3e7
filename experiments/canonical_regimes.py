"""The twelve canonical protocols: solver against surrogate, with the seconds both need.

The surrogate is timed three ways, on one thread and warmed up: the plain Keras call (`model.predict`, as most scripts
do it), our predictor on one protocol, and our predictor on a batch, per trajectory. Our predictor is ONNX Runtime where
the model is exported. Source: the paper's section "Canonical adhesion regimes" and its timing table.

Usage: `python -m experiments.canonical_regimes [--config FILE] [--models DIR] [--out FILE]`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from bem import Trajectory
from bem.command import run_main
from bem.measurement import FMS
from experiments import studies
from experiments.measuring import timed

if TYPE_CHECKING:
    import keras

    from surrogate.predictor import Surrogate

CONFIG = studies.CONFIGS / "canonical_regimes.toml"
OUT = studies.RESULTS / "canonical_regimes.json"
SCALARS = ("pull_off_force", "pull_off_time", "hysteresis", "max_compression", "end_force")


def median_seconds(call: Callable[[], Any], repetitions: int) -> float:
    """Median wall-clock seconds of a call, after one that is not counted."""
    return float(np.median(timed(call, repetitions)))


def keras_inputs(trained: Surrogate, steps: dict[str, np.ndarray], tabor: float) -> list[np.ndarray]:
    """The scaled arrays of one trajectory, as the Keras model takes them."""
    from surrogate.features import channels, edge_from_counts

    times, indentations = steps["time"][np.newaxis], steps["indentation"][np.newaxis]
    physical = channels(times, indentations, edge_from_counts(FMS, 1), trained.scaling.features)
    return [trained.scaling.scale_channels(physical), trained.scaling.scale_tabor(np.array([tabor]))]


def batch_seconds(trained: Surrogate, steps: dict[str, np.ndarray], tabor: float, batch: int) -> float:
    """Seconds of our predictor for each trajectory of a batch."""
    times, indentations = (np.repeat(steps[name][np.newaxis], batch, axis=0) for name in ("time", "indentation"))
    return median_seconds(lambda: trained.predict(times, indentations, tabor=tabor), 3) / batch


def regime(protocol: dict[str, Any], trained: Surrogate, model: keras.Model, config: dict[str, Any]) -> dict[str, Any]:
    """One protocol: native history, measurement steps, prediction, scalars, errors and seconds.

    Args:
        protocol: A row of the timing table.
        trained: Our predictor.
        model: The Keras model of the same weights.
        config: The study's configuration.
    """
    from surrogate.metrics import hysteresis, nmae, pull_off

    tabor, repetitions = protocol["tabor"], config["repetitions"]

    def solve() -> Trajectory:
        return studies.simulated(protocol, modulus_ratio=config["modulus_ratio"], accuracy=config["accuracy"])

    trajectory = solve()
    steps = studies.on_steps(protocol, trajectory)
    force = studies.predicted(trained, steps, FMS, tabor)
    inputs = keras_inputs(trained, steps, tabor)
    first = FMS[0] + FMS[1] - 1
    found, reference = (
        {
            "pull_off_force": float(pull_off(steps["time"][None], values[None], first)[0][0]),
            "hysteresis": float(hysteresis(steps["indentation"][None], values[None])[0]),
        }
        for values in (force, steps["force"])
    )
    return {
        "sample": int(protocol["sample"]),
        "protocol": {name: protocol[name] for name in studies.QUANTITIES},
        "native": studies.lists({name: getattr(trajectory, name) for name in ("time", "indentation", "force")}),
        "steps": studies.lists({**steps, "predicted": force}),
        "solver": {name: getattr(trajectory, name) for name in SCALARS} | {"jumps": len(trajectory.jumps)},
        "surrogate": found,
        "errors_percent": {name: studies.percent(found[name], reference[name]) for name in found}
        | {"nmae": float(nmae(force[None], steps["force"][None])[0])},
        "seconds": {
            "solver": median_seconds(solve, repetitions),
            "keras_call": median_seconds(lambda: model.predict(inputs, verbose=0), repetitions),
            "predictor": median_seconds(lambda: studies.predicted(trained, steps, FMS, tabor), repetitions),
            "predictor_batch": batch_seconds(trained, steps, tabor, config["batch"]),
        },
        "paper_seconds": {"solver": protocol["bem_seconds"], "surrogate": protocol["surrogate_seconds"]},
    }


def summary(regimes: list[dict[str, Any]]) -> dict[str, float]:
    """Medians and factors over the twelve protocols."""
    columns = {name: np.array([one["seconds"][name] for one in regimes]) for name in regimes[0]["seconds"]}
    found = {f"median_{name}_seconds": float(np.median(values)) for name, values in columns.items()}
    factor = columns["solver"] / columns["predictor"]
    found |= {"least_factor": float(factor.min()), "median_factor": float(np.median(factor))}
    found["orders_of_magnitude"] = float(np.log10(np.median(factor)))
    found["median_pull_off_error_percent"] = float(
        np.median([one["errors_percent"]["pull_off_force"] for one in regimes])
    )
    return found


def main(
    config: Annotated[Path, typer.Option(help="TOML file.")] = CONFIG,
    models: Annotated[Path, typer.Option(help="Where trained models are.")] = studies.MODELS,
    out: Annotated[Path, typer.Option(help="Result file to write.")] = OUT,
) -> None:
    """Simulate, predict and time the twelve protocols."""
    settings = studies.read_config(config, "model", "modulus_ratio", "accuracy", "repetitions", "batch")
    trained = studies.load_surrogate(settings["model"], models)
    model = studies.load_surrogate(settings["model"], models, backend="keras").model
    regimes: list[dict[str, Any]] = []
    for protocol in studies.paper_protocols("canonical_protocols"):
        regimes.append(regime(protocol, trained, model, settings))
        print(f"({regimes[-1]['sample']}) " + "  ".join(f"{k} {v:.3g} s" for k, v in regimes[-1]["seconds"].items()))
    backend = type(trained.backend).__name__
    found = summary(regimes) | {"measurement_steps": sum(FMS), "steps_by_phase": ", ".join(map(str, FMS))}
    studies.write_result(
        out, "canonical_regimes", {"config": settings, "backend": backend, "summary": found, "regimes": regimes}
    )


if __name__ == "__main__":
    run_main(main)
