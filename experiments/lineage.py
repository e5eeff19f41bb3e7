"""Whether a model and a data set belong together: trajectory indices are valid in one data set only.

`surrogate.training.identity` says from which training a model comes, and how two trainings differ.
"""

from __future__ import annotations

from pathlib import Path

from surrogate.training.identity import read_identity


def dataset_digest(path: Path) -> str:
    """Digest of a data set file, the one that trainings record.

    Raises:
        FileNotFoundError: no such file.
    """
    from surrogate.data.dataset import TrajectoryDataset

    if not path.is_file():
        raise FileNotFoundError(f"data set {str(path)!r} not found; `make dataset` makes it")
    return TrajectoryDataset.load(path).sha256


def require_dataset(folder: Path, dataset: Path) -> str:
    """Digest of the data set a model was trained on, which must be that file's.

    Raises:
        ValueError: the model was trained on another data set.
    """
    trained_on, received = read_identity(folder).dataset, dataset_digest(dataset)
    if trained_on != received:
        raise ValueError(
            f"model {folder.name!r} must have been trained on {str(dataset)!r}, of digest {received[:12]}; "
            f"received one trained on a data set of digest {trained_on[:12]}: remove {str(folder)!r} and train it anew"
        )
    return received
