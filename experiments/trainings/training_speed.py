"""What training costs: the 18 paper models by our recipe and the paper's, batch after batch on one core of one machine.

The record of a published model states what its training took on its own processor, and these processors differ; some
were trained on a GPU. Here all 18 are timed on batches of the data set's size, one after another. The hours of a
training are those of its batches, without the validation after each epoch. A block holds as many batches as lie between
two refinements of the optimizer's bases, which cost more than the batches between them.

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

PAPER = "paper"
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


def epoch_seconds(speed: Any, recipe: dict[str, Any], architecture: str, trajectories: int) -> float | None:
    """Core seconds of the batches of an epoch, from the result of this study; `None` where it has not timed them."""
    if speed is None:
        return None
    ours = {name: one["seconds_per_batch"] for name, one in speed["models"].items()}
    timed = {speed["recipe"]: ours, PAPER: speed.get("by_paper_recipe", {})}
    batch = timed.get(recipe["name"], {}).get(architecture)
    return batch and -(-trajectories // recipe["batch_size"]) * batch["median"]


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

    chosen, theirs = Recipe.load(recipe), Recipe.load(PAPER)
    size = len(TrajectoryDataset.load(dataset).split(chosen.seed).train)

    def measured(by: Recipe) -> dict[str, Any]:
        found = {}
        for name in progress(only or names(), f"architectures by {by.name}"):
            found[name] = spread(seconds_of_batches(name, by, -(-size // by.batch_size), repeats))
            print(f"{name:10} {1e3 * found[name]['median']:6.0f} ms a batch")
        return found

    batches, seconds = -(-size // chosen.batch_size), measured(chosen)
    if only:
        return None
    hours = {name: one["median"] * batches * chosen.epochs / 3600.0 for name, one in seconds.items()}
    models = {name: {"seconds_per_batch": one, "hours": hours[name]} for name, one in seconds.items()}
    longest = max(models, key=lambda name: models[name]["hours"])
    return {
        "recipe": chosen.name,
        "epochs": chosen.epochs,
        "batches": batches,
        "models": models,
        "by_paper_recipe": measured(theirs),
        "longest_training": longest,
        "longest_training_hours": models[longest]["hours"],
        "backend": versions(),
    }
