"""Publish the median seed: of each model with all its seeds, the training with the median held-out MSE.

The seed replaces the published model of that name, together with the files that follow from its weights: `model.onnx`,
and the split into training, validation and test parts, which the seeds share. A model that is its median seed already
is left unchanged, so that the command can be repeated as seeds arrive. `make median-seeds` also updates the manifest
and the list of models that belong to the shipped forces.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from experiments.seeds.ranking import EXPECTED, found_seeds
from surrogate.architectures.naming import paper_names
from surrogate.data.dataset import TrajectoryDataset
from surrogate.network.onnx_file import ONNX_NAME
from surrogate.training.identity import PUBLISHED_SEED
from surrogate.training.publishing import publish

WEIGHTS = "model.weights.h5"


def median_seeds(trainings: dict[str, list[dict[str, Any]]]) -> dict[str, int]:
    """The seed with the median test MSE, for each paper model with all its seeds; their number is odd."""
    complete = {name: found for name, found in trainings.items() if name in paper_names() and len(found) == EXPECTED}
    ranked = {
        name: sorted(found, key=lambda one: (one["row"]["test_mse"], one["seed"])) for name, found in complete.items()
    }
    return {name: found[EXPECTED // 2]["seed"] for name, found in ranked.items()}


def is_published(seed: Path, model: Path) -> bool:
    """Whether a model directory is complete and holds the given seed."""
    weights, run = model / WEIGHTS, model / "run.json"
    if not all(path.is_file() for path in (weights, run, model / ONNX_NAME, model / "split.json")):
        return False
    same = (seed / WEIGHTS).read_bytes() == weights.read_bytes()
    return same and json.loads(run.read_text(encoding="utf-8")).get(PUBLISHED_SEED) == seed.name


def publish_seed(seed: Path, model: Path, data: TrajectoryDataset, test: list[int]) -> None:
    """Publish a seed under the name of its model, completely or not at all.

    Args:
        seed: Directory of the seed.
        model: The model directory to write.
        data: The shipped data set.
        test: Trajectories of the seed's test part.

    Raises:
        ValueError: The test part of the seed is not that of the data set's split.
    """
    split = data.split()
    if not np.array_equal(split.test, test):
        raise ValueError(f"expected the test part of the data set's split of seed 0; received another in {seed}")
    with tempfile.TemporaryDirectory() as place:
        folder = shutil.copytree(seed, Path(place) / "model")
        split.save(folder / "split.json")
        run = json.loads((folder / "run.json").read_text(encoding="utf-8")) | {
            "name": model.name,
            PUBLISHED_SEED: seed.name,
        }
        (folder / "run.json").write_text(json.dumps(run, indent=1) + "\n", encoding="utf-8")
        export(folder)
        publish(Path(place), model, replace=True)


def export(folder: Path) -> None:
    """Write `model.onnx`. Keras is imported here, since a complete model does not need it."""
    from surrogate.backend import import_keras

    import_keras()
    from surrogate.export.onnx import export_folder

    export_folder(folder)


def study(dataset: Path, models: Path, seeds: Path) -> None:
    """Publish the median seed of each model that has all its seeds."""
    data = TrajectoryDataset.load(dataset)
    trainings, _ = found_seeds(seeds, data.sha256, data.forces_sha256)
    chosen = median_seeds(trainings)
    for name, number in chosen.items():
        seed, model = seeds / name / f"seed-{number}", models / name
        if is_published(seed, model):
            print(f"{name}: {seed.name} is published already")
            continue
        (test,) = (one["test part"] for one in trainings[name] if one["seed"] == number)
        publish_seed(seed, model, data, test)
        print(f"{name}: {seed.name}, of the median test MSE of {EXPECTED} seeds, is published", flush=True)
    rest = [name for name in paper_names() if name not in chosen]
    print(
        f"{len(chosen)} of {len(paper_names())} models are median seeds; too few seeds of {', '.join(rest) or 'none'}"
    )
