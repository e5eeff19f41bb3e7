"""Size against error: how few parameters reproduce the paper's error, beside the 18 models of the paper.

One LSTM of 8 to 256 units on the inputs F and on physical measurement steps, trained as the pretrained `fast` is (its
data, its recipe, for fewer epochs on half of its trajectories), and the published models of the paper. Errors are those
on hidden protocols at the paper's modulus ratio, the same for all, and those on the part of its own data set that a
model has not seen. An interrupted measurement continues with the training where it stopped.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

import surrogate
from bem import Trajectory
from bem._support.plain_json import plain
from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import measurement_grid
from experiments.common import MODELS, MODULUS_RATIO, write_result
from experiments.surrogates.hidden_protocols import ANY_SOLID, Hidden, quantiles
from experiments.surrogates.model_calls import ask
from experiments.timing import MEASUREMENTS, Models, Out, force_error, progress
from surrogate.architectures.naming import paper_names
from surrogate.backend import import_keras, limit_threads
from surrogate.pretrained.model import Pretrained

OUT = MEASUREMENTS / "size_error.json"
RUNS = Path("results/size_error")
DATASET = Path("results/dataset/any_solid.h5")
UNITS = (8, 16, 32, 64, 128, 256)
EPOCHS = 14
TRAJECTORIES = 32_768
"""Fewer epochs than those of the published `fast`, on half of its trajectories."""
METRICS = ("mse", "nmae_percent")
"""Errors on the unseen part of a model's own data set, means of `surrogate.data.metrics`: scaled force, and force."""


def trained(units: int, dataset: Path, trajectories: int, epochs: int, runs: Path) -> Pretrained:
    """One LSTM of so many units; what is finished is read, what is not is continued."""
    from surrogate.data.dataset import TrajectoryDataset
    from surrogate.training.pretrained import DEFINITIONS, Definition, train_model

    name = f"lstm-{units}"
    folder = runs / f"{name}-{trajectories}-{epochs}"
    data = TrajectoryDataset.load(dataset)
    if not (folder / name / "bands.npz").is_file():

        def report(epoch: Any) -> None:
            said = f"epoch {epoch.row['epoch']} of {epoch.epochs}, {epoch.seconds_left / 60.0:.0f} min left"
            print(f"{name}: {said}, validation MSE {epoch.row['validation_mse']:.3e}", flush=True)

        definition = Definition((units,), trajectories, replace(DEFINITIONS["fast"].recipe, epochs=epochs))
        train_model(name, definition, data, folder, report=report)
    model = Pretrained(folder / name)
    if model.run["dataset_sha256"] != data.sha256:
        raise ValueError(f"{folder} must be of the data set {dataset}; received one of another; remove the folder")
    return model


def unseen(model: Pretrained, dataset: Path, trajectories: int) -> dict[str, float]:
    """Mean errors `METRICS` on the trajectories that were neither trained on nor used to choose the epoch."""
    from surrogate.data.dataset import TrajectoryDataset
    from surrogate.data.metrics import nmae
    from surrogate.training.pretrained import first

    data = TrajectoryDataset.load(dataset)
    indices = first(data, trajectories).test
    part = Hidden(data.protocols_of(indices))
    found = np.array([one.force for one in ask(model, part, any_solid=True)])
    scaled = model.scaling.scale_force(found) - model.scaling.scale_force(data.force[indices])
    return {"mse": float(np.mean(scaled**2)), "nmae_percent": float(nmae(found, data.force[indices]).mean())}


def compared(found: Sequence[Trajectory], true: Sequence[Trajectory], hidden: Hidden) -> dict[str, dict[str, float]]:
    """Errors of pull-off force, hysteresis and force, the last one at the paper's measurement steps, over its range."""
    results = np.array([(one.pull_off_force, one.hysteresis) for one in found])
    exact = np.array([(one.pull_off_force, one.hysteresis) for one in true])
    pull_off, hysteresis = np.abs(results / exact - 1.0).T
    steps, _ = measurement_grid(**{name: values for name, values in hidden.quantities.items() if name in QUANTITIES})

    def at_steps(trajectories: Sequence[Trajectory]) -> np.ndarray:
        pairs = zip(trajectories, steps, strict=True)
        return np.array([one.at(np.clip(instants, one.time[0], one.time[-1])) for one, instants in pairs])

    errors = {"pull_off": pull_off, "hysteresis": hysteresis, "force": force_error(at_steps(found), at_steps(true))}
    return {name: quantiles(values) for name, values in errors.items()}


def kept(out: Path, settings: dict[str, int], units: Sequence[int]) -> list[dict[str, Any]]:
    """The rows of the LSTMs in the last result.

    Raises:
        ValueError: There is none, or its settings or sizes are others.
    """
    last = json.loads(out.read_text(encoding="utf-8")) if out.is_file() else {"lstm": []}
    found = {name: last.get(name) for name in settings}, [row["units"] for row in last["lstm"]]
    if found != (settings, [*units]):
        raise ValueError(
            f"{out} must hold LSTMs of {[*units]} units with {settings}; received {found[1]} with {found[0]}"
        )
    return last["lstm"]


def main(
    count: Annotated[int, typer.Option(help="How many hidden protocols of each kind.")] = 2000,
    units: Annotated[list[int] | None, typer.Option(help="Units of an LSTM; repeat the option.")] = None,
    trajectories: Annotated[
        int, typer.Option(help="How many of the data set are used, the first ones.")
    ] = TRAJECTORIES,
    epochs: Annotated[int, typer.Option(help="Of each training.")] = EPOCHS,
    dataset: Annotated[Path, typer.Option(help="Any standard linear solids on physical steps.")] = DATASET,
    runs: Annotated[Path, typer.Option(help="Where trainings are kept.")] = RUNS,
    models: Models = MODELS,
    out: Out = OUT,
    keep_lstms: Annotated[
        bool, typer.Option(help="Keep the LSTMs of the last result, and compare the models of the paper again.")
    ] = False,
) -> None:
    """Train what is not trained yet, and compare on the same hidden protocols."""
    settings = {"count": count, "trajectories": trajectories, "epochs": epochs}
    content: dict[str, Any] = {
        **settings,
        "lstm": kept(out, settings, units or UNITS) if keep_lstms else [],
        "paper": [],
    }
    limit_threads(1)
    import_keras()
    several = () if keep_lstms else units or UNITS
    lstms = {size: trained(size, dataset, trajectories, epochs, runs) for size in several}
    kinds = {"paper": Hidden.draw(count, MODULUS_RATIO)} | ({"any": Hidden.draw(count, ANY_SOLID)} if lstms else {})
    truth = {kind: list(progress(hidden.simulated(), f"solver, {kind}", len(hidden))) for kind, hidden in kinds.items()}
    for size, model in lstms.items():
        row = {"units": size, "parameters": model.run["parameters"], "core_seconds": model.run["cpu_seconds"]}
        row["test"] = unseen(model, dataset, trajectories)
        for kind, hidden in kinds.items():
            row[kind] = compared(ask(model, hidden, any_solid=True), truth[kind], hidden)
        content["lstm"].append(row)
        print(row)
    published = [name for name in paper_names() if (models / name / "run.json").is_file()]
    for name in progress(published, "models of the paper"):
        metrics = json.loads((models / name / "metrics.json").read_text(encoding="utf-8"))
        test = {metric: metrics["test"][metric]["mean"] for metric in METRICS}
        found = ask(surrogate.load(name, models), kinds["paper"], any_solid=False)
        row = {"name": name, "parameters": metrics["parameters"], "test": test}
        content["paper"].append(row | {"paper": compared(found, truth["paper"], kinds["paper"])})
    options = f"--count {count} --trajectories {trajectories} --epochs {epochs}"
    chosen = "".join(f" --units {size}" for size in units or ())
    write_result(out, f"size_error {options}{chosen}{' --keep-lstms' if keep_lstms else ''}", plain(content))
