"""Check that a model and a data set belong together: a trajectory index is valid in one data set only.

`surrogate.training.identity` states how a model was trained, and how two trainings differ.
"""

from __future__ import annotations

from pathlib import Path

from surrogate.training.identity import read_identity


def dataset_digest(path: Path) -> str:
    """Digest of a data set file, as trainings record it.

    Raises:
        FileNotFoundError: The file does not exist.
    """
    from surrogate.data.dataset import TrajectoryDataset

    if not path.is_file():
        raise FileNotFoundError(f"data set {str(path)!r} not found; `make dataset` makes it")
    return TrajectoryDataset.load(path).sha256


def require_dataset(folder: Path, dataset: Path) -> str:
    """Digest of a data set file on which the model must have been trained.

    Raises:
        FileNotFoundError: The data set file does not exist.
        ValueError: The model was trained on another data set.
    """
    trained_on, received = read_identity(folder).dataset, dataset_digest(dataset)
    if trained_on != received:
        raise ValueError(
            f"model {folder.name!r} must have been trained on {str(dataset)!r}, of digest {received[:12]}; "
            f"received one trained on a data set of digest {trained_on[:12]}: remove {str(folder)!r} and train it again"
        )
    return received
