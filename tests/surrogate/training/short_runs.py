"""Recipes of a few epochs, and what such a run leaves."""

import csv

import h5py

from bem.dataset.sealed_file import arrays
from surrogate.training.recipe import Recipe

COSINE = 'optimizer = "soap"\nweight_average = 0.5\ngradient_norm = 1.0\n[cosine]\nwarmup_epochs = 1\n'


def recipe(tmp_path, table=COSINE, epochs=4, rate=1e-2):
    path = tmp_path / "recipe.toml"
    path.write_text(f'name = "test"\nseed = 3\nbatch_size = 20\nepochs = {epochs}\nlearning_rate = {rate}\n{table}')
    return Recipe.load(path)


def weights(folder):
    """The published weights of a run, and those of its last epoch with the state of the optimizer, by path."""
    found = {}
    for path in (folder / "model/model.weights.h5", folder / "backup/latest.weights.h5"):
        with h5py.File(path) as file:
            found |= {f"{path.name}/{name}": item[()] for name, item in arrays(file)}
    return found


def history(folder):
    with (folder / "history.csv").open() as file:
        return [{k: float(v) for k, v in row.items() if "seconds" not in k} for row in csv.DictReader(file)]


class StopAfter:
    def __init__(self, epochs):
        self.left = epochs

    def __call__(self):
        self.left -= 1
        return self.left == 0
