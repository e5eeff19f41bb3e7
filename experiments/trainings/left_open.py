"""Trainings by recipe `swift` of what the paper leaves open and no evaluation can tell; each continues where it ended.

- `threshold`: the paper does not say the threshold c of its symmetric logarithm, sign(x) log(1 + abs(x) / c). The
  reference model is trained on forces in the unit c = 0.01, in which the published MSE comes nearest to the paper's,
  and compared, in this unit, with the 18 models that the same recipe trained in the unit 1.
- `equal_parameters`: the paper does not say the sizes of M2, M3, M5 and M6. M3, M5 and M6 are trained with as many
  parameters as the reference model, which M2 has already.

Source: the paper's sections "Surrogate-model inputs and targets" and "DL Models' architecture".
"""

import shlex
import sys
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from bem.dataset.measurement_steps import FIRST_UNLOADING
from experiments import common
from experiments.common import Dataset, Models
from experiments.harness import progress
from experiments.measurements.statistics import in_units, medians
from experiments.published_models import METRICS, REFERENCE, read_model
from experiments.trainings.variants import WORK, Work
from surrogate.architectures.naming import FAMILIES, PARAMETER_COUNTS, paper_names
from surrogate.architectures.registry import register
from surrogate.data.dataset import TrajectoryDataset
from surrogate.data.metrics import physical_errors
from surrogate.training.interface import train

THRESHOLD = 0.01
"""Of the symmetric logarithm, in pi R dgamma."""
EQUAL_UNITS = {"M3": 220, "M6": 151, "M5": 107}
"""Units with which a family of unstated size has the parameters of the reference model, within 2 %."""


def finished(name: str, data: TrajectoryDataset, label: str, work: Path) -> dict[str, Any] | None:
    """What `read_model` says of a training, after it; `None` if it was stopped."""
    command = f"{sys.argv[0]} {shlex.join(sys.argv[1:])}"
    done = train(name, data, out=work / "models" / label, runs=work / "runs", command=command)
    return read_model(work / "models" / label) if done else None


def study_threshold(dataset: Dataset, models: Models, *, work: Work = WORK / "threshold") -> dict[str, Any] | None:
    """Train the reference model in another unit of the force, and compare it with all models in this unit."""
    data, label = TrajectoryDataset.load(dataset), f"{REFERENCE}-threshold-{THRESHOLD:g}"
    model = finished(REFERENCE, replace(data, force=data.force / THRESHOLD), label, work)
    if model is None:
        return None
    split = data.split()
    grid, tabor, reference = data.grid(split.test), data.protocols["tabor"][split.test], data.force[split.test]
    own = common.predicted(common.load_surrogate(label, work / "models"), *grid, tabor) * THRESHOLD
    forces = [
        common.predicted(common.load_surrogate(name, models), *grid, tabor)
        for name in progress(paper_names(), "models")
    ]
    true, *scaled = in_units(THRESHOLD, data.force[split.train], reference, own, *forces)
    mse, *errors = (float(((values - true) ** 2).mean()) for values in scaled)
    by_model = dict(zip(paper_names(), errors, strict=True))
    return {
        "threshold": THRESHOLD,
        "mse": mse,
        **medians(physical_errors(own, reference, *grid, FIRST_UNLOADING)),
        **{name: model[name] for name in ("epochs", "hours", "backend")},
        "in_the_unit_1": by_model,
        "best": min(by_model, key=by_model.__getitem__),
        "rank": 1 + sum(error < mse for error in errors),
    }


def study_equal_parameters(
    dataset: Dataset, models: Models, *, work: Work = WORK / "equal_parameters"
) -> dict[str, Any] | None:
    """Train each family of unstated size with the parameters of the reference model."""
    data = TrajectoryDataset.load(dataset)
    records: dict[str, dict[str, Any]] = {}
    for family, units in EQUAL_UNITS.items():
        module = FAMILIES[family].builder
        builder = getattr(import_module(f"surrogate.architectures.{module}"), module)
        register(f"{family}-{units}", partial(builder, units=units), conditionings=["concat"])
        name = f"{family}-{units}-concat"
        if (model := finished(name, data, name, work)) is None:
            return None
        guess = read_model(models / f"{family}-concat")
        records[family] = {
            "units": units,
            **{key: model[key] for key in ("parameters", "epochs", "hours", "backend", *METRICS)},
            "guess": {key: guess[key] for key in ("parameters", *METRICS)},
        }
    reference = read_model(models / REFERENCE)
    of_reference = {key: reference[key] for key in ("parameters", *METRICS)}
    return {"parameters": PARAMETER_COUNTS[REFERENCE], "reference": of_reference, "families": records}
