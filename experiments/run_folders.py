"""Records of many trainings in one HDF5 file: errors on each test trajectory, learning curve, and settings.

A group has the tables `test_errors` and `history`, of shape (rows, columns), whose attribute `columns` names the
columns. `published/seeds.h5` holds the seeds of each model in groups `MODEL/seed-S`, whose attributes `run`, `metrics`
and `recipe` are JSON text. `published/models/trainings.h5` holds the tables of each published model by its name.

Usage: `python -m experiments.run_folders FILE FOLDER ...` adds the folders that `surrogate train MODEL --seed S
--label MODEL-seed-S` wrote, or replaces their groups; `python -m experiments.run_folders MODELS` moves the tables of
all model directories of a folder to `MODELS/trainings.h5`, and a split that they share to `MODELS/split.json`.
"""

import argparse
import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from bem._support.outputs import whole_file
from bem._support.text_files import read_json

TABLES = ("history", "test_errors")
TRAININGS = "trainings.h5"


def read_csv(path: Path) -> dict[str, np.ndarray]:
    """Columns of a table of numbers that a training writes, by name.

    Raises:
        FileNotFoundError: The file does not exist.
    """
    if not path.is_file():
        raise FileNotFoundError(f"no table of a trained model at {str(path)!r}; `surrogate train` writes it")
    names, *rows = path.read_text(encoding="utf-8").splitlines()
    return dict(zip(names.split(","), np.array([row.split(",") for row in rows], dtype=float).T, strict=True))


def read_table(folder: Path, table: str) -> dict[str, np.ndarray]:
    """Columns of a table of `TABLES` of a model directory, by name: its own, or that in `trainings.h5` beside it.

    Raises:
        FileNotFoundError: There is neither.
    """
    own, shared = folder / f"{table}.csv", folder.parent / TRAININGS
    if not own.is_file() and shared.is_file():
        with h5py.File(shared) as trainings:
            if folder.name in trainings:
                return _columns(trainings[folder.name][table])
    return read_csv(own)


def read_training(folder: Path) -> dict[str, Any]:
    """Tables and settings of a training from its folder, by name.

    Raises:
        ValueError: A file is missing or damaged.
    """
    try:
        settings = {name: read_json(folder / f"{name}.json") for name in ("run", "metrics")}
        settings["recipe"] = settings["run"]["recipe"]
        return settings | {name: read_csv(folder / f"{name}.csv") for name in TABLES}
    except (OSError, ValueError, KeyError) as error:
        raise ValueError(f"expected a complete training; received {str(folder)!r} ({error!r:.100})") from error


def read_trainings(file: Path) -> dict[str, dict[str, Any]]:
    """Tables and settings of every seed in a file, by `MODEL/seed-S`; none if the file does not exist."""
    if not file.is_file():
        return {}
    with h5py.File(file) as trainings:
        groups = {f"{model}/{seed}": group for model, seeds in trainings.items() for seed, group in seeds.items()}
        return {
            name: {key: json.loads(text) for key, text in group.attrs.items()}
            | {table: _columns(group[table]) for table in TABLES}
            for name, group in groups.items()
        }


def _columns(table: h5py.Dataset) -> dict[str, np.ndarray]:
    return dict(zip(table.attrs["columns"], table[:].T, strict=True))


@contextmanager
def opened(file: Path) -> Iterator[h5py.File]:
    """Open an HDF5 file, or a new one, to be changed completely or not at all."""
    with whole_file(file) as temporary:
        if file.is_file():
            shutil.copyfile(file, temporary)
        with h5py.File(temporary, "a") as trainings:
            yield trainings


def add_tables(trainings: h5py.File, name: str, training: dict[str, Any]) -> h5py.Group:
    """Write the tables of a training as the group `name`, in place of a group of this name."""
    if name in trainings:
        del trainings[name]
    group = trainings.create_group(name)
    for table in TABLES:
        rows = np.column_stack(list(training[table].values()))
        group.create_dataset(table, data=rows, compression="gzip", shuffle=True).attrs["columns"] = list(
            training[table]
        )
    return group


def add_seeds(file: Path, folders: list[Path]) -> None:
    """Add the trainings of `folders` to a file, each by its label and seed, all or none.

    Raises:
        ValueError: A training is not complete.
    """
    with opened(file) as trainings:
        for folder in folders:
            training = read_training(folder)
            seed = f"seed-{training['run']['seed']}"
            name = f"{training['run']['name'].removesuffix(f'-{seed}')}/{seed}"
            group = add_tables(trainings, name, training)
            group.attrs.update({key: json.dumps(training[key]) for key in ("run", "metrics", "recipe")})


def move_tables(models: Path) -> None:
    """Move the tables of all model directories of a folder to `trainings.h5`, and a split that they share beside it."""
    folders = sorted(path.parent for path in models.glob("[!.]*/test_errors.csv"))
    with opened(models / TRAININGS) as trainings:
        for folder in folders:
            add_tables(trainings, folder.name, {table: read_csv(folder / f"{table}.csv") for table in TABLES})
    shared = models / "split.json"
    for folder in folders:
        if (split := folder / shared.name).is_file():
            if not shared.exists():
                shutil.copyfile(split, shared)
            if split.read_bytes() == shared.read_bytes():
                split.unlink()
        for name in ("test_errors.csv", "history.csv"):  # a folder that has the first is gathered again
            (folder / name).unlink(missing_ok=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("folders", type=Path, nargs="*", metavar="FOLDER")
    arguments = parser.parse_args()
    if arguments.file.is_dir():
        move_tables(arguments.file)
    else:
        add_seeds(arguments.file, arguments.folders)
