"""What training costs: the 18 paper models by one recipe, batch after batch on one core of one machine.

The record of a published model states what its training took on its own processor, and these processors differ. Here
all 18 are timed on batches of the data set's size, one after another. The hours of a training are those of its batches,
without the validation after each epoch. A block holds as many batches as lie between two refinements of the optimizer's
bases, which cost more than the batches between them.

The environment variable `KERAS_BACKEND` selects another backend.
"""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem.dataset.measurement_steps import FMS
from experiments.measurements.harness import Repeats, progress, timed
from experiments.measurements.statistics import spread
from surrogate.backend import import_keras, limit_threads, versions

BLOCK = 10  # batches in a block if the optimizer has no bases


def seconds_of_batches(name: str, recipe: Any, batches: int, repeats: int) -> list[float]:
    """Seconds of one batch: the mean over each of `repeats` blocks, after one block that is not counted.

    The recipe sets batch size and optimizer, the batches in an epoch the schedule of the learning rate.
    """
    import keras

    import surrogate
    from surrogate.training.fitting import compile_by, with_fused_lstm

    keras.utils.clear_session()
    model = with_fused_lstm(surrogate.build(name))
    compile_by(recipe, model, batches)
    draw, size, steps = np.random.default_rng(0), recipe.batch_size, sum(FMS)
    shapes = (size, steps, model.input_shape[0][-1]), (size, 1), (size, steps, 1)
    sequence, tabor, force = (draw.normal(size=shape).astype(np.float32) for shape in shapes)
    length = getattr(model.optimizer, "basis_every", BLOCK)

    def block() -> None:
        for _ in range(length):
            model.train_on_batch([sequence, tabor], force)

    return [seconds / length for seconds in timed(block, repeats)]


def study(
    dataset: Path,
    *,
    recipe: Annotated[str, typer.Option(help="Name of a recipe, or its file.")] = "swift",
    only: Annotated[list[str] | None, typer.Option(help="Time this model only and write nothing; repeatable.")] = None,
    repeats: Repeats = 3,
) -> dict[str, Any] | None:
    """Measure every architecture; the size of the data set sets the batches of an epoch."""
    limit_threads(1)
    import_keras()
    from surrogate.architectures.naming import names
    from surrogate.data.dataset import TrajectoryDataset
    from surrogate.training.recipe import Recipe

    chosen = Recipe.load(recipe)
    batches = -(-len(TrajectoryDataset.load(dataset).split(chosen.seed).train) // chosen.batch_size)
    models = {}
    for name in progress(only or names(), "architectures"):
        seconds = spread(seconds_of_batches(name, chosen, batches, repeats))
        hours = seconds["median"] * batches * chosen.epochs / 3600.0
        models[name] = {"seconds_per_batch": seconds, "hours": hours}
        print(f"{name:10} {1e3 * seconds['median']:6.0f} ms a batch, {hours:.2f} h")
    if only:
        return None
    longest = max(models, key=lambda name: models[name]["hours"])
    return {
        "recipe": chosen.name,
        "epochs": chosen.epochs,
        "batches": batches,
        "models": models,
        "longest_training": longest,
        "longest_training_hours": models[longest]["hours"],
        "backend": versions(),
    }
