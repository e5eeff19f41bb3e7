"""Hand trainings by the paper's recipe to `train.py` on a GPU, and take back what it wrote.

Usage, with PyTorch installed and `KERAS_BACKEND=torch`: `python unfinished/gpu/exchange.py prepare FOLDER LABEL ...`,
with labels of published models (`M5-FiLM-paper`, `M1-concat-inputs-C-paper`, `M1-concat-as-worded`). A training begun
in `results/training` goes on. Then run `train.py` on the GPU with this folder. `exchange.py collect FOLDER` makes
folders of runs of its results, which `surrogate train` publishes or trains further.
"""

import argparse
import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import keras
import numpy as np

from surrogate.architectures import build
from surrogate.data.dataset import TrajectoryDataset
from surrogate.data.examples import joined_examples, scaled_examples
from surrogate.training.fitting import compile_by, started
from surrogate.training.recipe import Recipe
from surrogate.training.run_folder import BACKUP, COLUMNS, Progress, best_weights, read_progress, save_progress
from surrogate.training.runs import Run, fit_scaling

RUNS, DATASET = Path("results/training"), Path("published/dataset.h5")
WORDED = "-as-worded"


def run_of(label: str) -> Run:
    """The training that a label names."""
    dataset = TrajectoryDataset.load(DATASET)
    recipe = Recipe.load("paper-as-worded" if label.endswith(WORDED) else "paper")
    architecture, _, features = label.removesuffix(WORDED).removesuffix("-paper").partition("-inputs-")
    split = dataset.split(recipe.seed)
    return Run(architecture, dataset, split, recipe, features=features or "D", label=label)


def model_of(run: Run) -> keras.Model:
    """The untrained network with its optimizer."""
    model = started(lambda: build(run.architecture, features=run.features), run.recipe.seed)
    compile_by(run.recipe, model, -(-len(run.split.train) // run.recipe.batch_size), metrics=["mae"])
    return model


def joined(variables: list[Any]) -> np.ndarray:
    """Weights as one vector."""
    return np.concatenate([keras.ops.convert_to_numpy(one).ravel() for one in variables]).astype(np.float32)


def put(flat: np.ndarray, variables: list[Any]) -> None:
    """Set weights from one vector."""
    ends = np.cumsum([int(np.prod(one.shape)) for one in variables])
    for one, values in zip(variables, np.split(flat, ends[:-1]), strict=True):
        one.assign(values.reshape(one.shape))


def prepare(folder: Path, labels: list[str]) -> None:
    """Write the data set and the states of the trainings."""
    arrays, jobs = {}, []
    for features in "CD":
        run = run_of(f"M1-concat-inputs-{features}-paper")
        scaling = fit_scaling(run)
        parts = {
            "train": joined_examples(run.training, scaling),
            "val": scaled_examples(run.dataset, run.split.validation, scaling),
        }
        for part, one in parts.items():
            arrays |= {f"{part}_tabor": one.tabor, f"{part}_force": one.force}
            arrays |= (
                {f"{part}_D": one.sequence} if features == "D" else {f"{part}_acceleration": one.sequence[..., 3:]}
            )
    for label in labels:
        run, begun = run_of(label), RUNS / label
        model = model_of(run)
        best, found = joined(model.trainable_variables), read_progress(begun)
        if found:
            model.load_weights(best_weights(begun, found[0]))
            best = joined(model.trainable_variables)
            model.load_weights(begun / BACKUP[0])
        optimizer, history = model.optimizer, found[0].history if found else []
        rows = [[row[name] for name in ("epoch", *COLUMNS)][:6] for row in history]
        state = {"flat": joined(model.trainable_variables), "best": best, "updates": int(optimizer.iterations.numpy())}
        state |= {"m": joined(optimizer._momentums), "v": joined(optimizer._velocities), "history": np.array(rows)}
        arrays |= {f"{label}:{name}": value for name, value in state.items()}
        shapes = {one.path: list(one.shape) for one in model.trainable_variables}
        gain = 1e-4 if run.recipe.plateau.least_gain is None else run.recipe.plateau.least_gain
        job = {"label": label, "architecture": run.architecture, "features": run.features, "gain": gain}
        jobs.append({**job, "shapes": shapes})
    folder.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(folder / "data.npz", **arrays)
    (folder / "jobs.json").write_text(json.dumps(jobs))


def collect(folder: Path) -> None:
    """Make folders of runs of what `train.py` wrote."""
    table = json.loads((folder / "table.json").read_text())
    parts = sorted(folder.glob("weights*"), key=lambda path: int(path.name.removeprefix("weights")))
    content, at = np.frombuffer(b"".join(path.read_bytes() for path in parts), np.float32), 0
    for label, found in table["jobs"].items():
        run, target = run_of(label), RUNS / label
        model = model_of(run)
        size, state = len(joined(model.trainable_variables)), {}
        for name in found["parts"]:
            state[name], at = content[at : at + size], at + size
        names = ("epoch", *list(COLUMNS)[:5])
        progress = Progress([dict(zip(names, row, strict=True)) | {"cpu_seconds": row[5]} for row in found["history"]])
        for row in progress.history:
            row["epoch"] = int(row["epoch"])
        shutil.rmtree(target, ignore_errors=True)
        best = best_weights(target, progress)
        for path in (best, target / BACKUP[0]):
            path.parent.mkdir(parents=True)
        put(state["best"], model.trainable_variables)
        model.save_weights(best)
        if not found["finished"]:
            for name, variables in zip(
                ("flat", "m", "v"),
                (model.trainable_variables, model.optimizer._momentums, model.optimizer._velocities),
                strict=True,
            ):
                put(state[name], variables)
            model.optimizer.iterations.assign(found["updates"])
            model.optimizer.learning_rate = found["rate"]
        model.save_weights(target / BACKUP[0])
        (target / BACKUP[1]).write_text(json.dumps({"epoch": progress.epoch, "batch": 0}))
        identity = replace(run.identity, backend=keras.backend.backend())
        save_progress(target, progress, identity.fingerprint)
        print(f"{label}: {progress.epoch} epochs, {'finished' if found['finished'] else 'not finished'}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("prepare", "collect"))
    parser.add_argument("folder", type=Path, help="what is handed over, and taken back")
    parser.add_argument("labels", nargs="*", help="of the trainings to hand over")
    chosen = parser.parse_args()
    prepare(chosen.folder, chosen.labels) if chosen.what == "prepare" else collect(chosen.folder)
