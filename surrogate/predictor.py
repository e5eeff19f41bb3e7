"""Trained models for users: physical arrays in, forces out.

Example:
    >>> import surrogate
    >>> from bem.measurement import measurement_grid
    >>> times, indentations = measurement_grid(
    ...     tabor=[1.0], peak_indentation=[20.0], loading_rate=[10.0], dwell_time=[1.0], unloading_rate=[10.0]
    ... )
    >>> force = surrogate.load("M1-concat").predict(times, indentations, tabor=[1.0])  # doctest: +SKIP
"""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import h5py
import keras
import numpy as np

from surrogate.architectures import build, names
from surrogate.features import channels, edge_from_indentations, plateau
from surrogate.scaling import Scaling
from surrogate.training import predict_scaled

PUBLISHED = Path(__file__).resolve().parents[1] / "published" / "models"

# Leaves room for rates recovered from rounded times.
RANGE_TOLERANCE = 1e-6


class ExtrapolationWarning(UserWarning):
    """A prediction was asked for outside the ranges the model was trained on."""


class Surrogate:
    """A trained model with its scaling.

    Args:
        model: A model of `surrogate.build`, trained.
        scaling: The scaling of its training set.
        name: The name shown in messages.
    """

    def __init__(self, model: keras.Model, scaling: Scaling, name: str = "surrogate") -> None:
        self.model = model
        self.scaling = scaling
        self.name = name

    @classmethod
    def load(cls, name: str | Path, root: str | Path | None = None) -> Surrogate:
        """Read a model directory; see `surrogate.load`."""
        folder = _find(name, Path(root) if root is not None else PUBLISHED)
        run = json.loads(_existing(folder / "run.json").read_text(encoding="utf-8"))
        scaling = Scaling.load(_existing(folder / "scaling.json"))
        if scaling.dataset_sha256 != run["dataset_sha256"] or scaling.features != run["features"]:
            raise ValueError(
                f"Expected the scaling of data set {run['dataset_sha256'][:12]} with features {run['features']}. "
                f"Received: {folder / 'scaling.json'} of data set {scaling.dataset_sha256[:12]} "
                f"with features {scaling.features}"
            )
        model = build(run["architecture"], features=run["features"])
        load_weights(model, _existing(folder / "model.weights.h5"))
        return cls(model, scaling, name=run["name"])

    def predict(
        self, times: np.ndarray, indentations: np.ndarray, *, tabor: np.ndarray, edge: np.ndarray | None = None
    ) -> np.ndarray:
        """Predict the force along indentation histories.

        Args:
            times: Times of shape `(batch, steps)`, strictly increasing along the steps. The models were trained on the
                fixed measurement steps of `bem.measurement.measurement_grid`.
            indentations: Indentations of the same shape.
            tabor: Tabor parameters of shape `(batch,)`, or one for all.
            edge: Marks of the dwell's onset and end, of the same shape as `times`. By default they are found: the first
                and last point of each history's longest run of constant indentation, none where nothing is constant.

        Returns:
            Forces P / (pi R dgamma), tension positive, of shape `(batch, steps)`, float64.

        Raises:
            ValueError: shapes that do not fit, NaN or infinity, times that do not increase, Tabor parameters not above
                zero.

        Warns:
            ExtrapolationWarning: once, when protocols leave the ranges of the training set.
        """
        times, indentations = (np.asarray(values, dtype=np.float64) for values in (times, indentations))
        tabor = np.asarray(tabor, dtype=np.float64)
        _check_history(times, indentations)
        if tabor.ndim > 1 or tabor.size not in (1, len(times)):
            raise ValueError(f"Expected one Tabor parameter per history ({len(times)}). Received: shape {tabor.shape}")
        tabor = np.broadcast_to(tabor.reshape(-1), (len(times),))
        if not (np.isfinite(tabor).all() and (tabor > 0).all()):
            raise ValueError(f"Expected finite Tabor parameters above zero. Received: tabor={tabor}")
        if edge is None:
            edge = edge_from_indentations(indentations)
        elif np.shape(edge) != times.shape:
            raise ValueError(f"Expected edge marks of shape {times.shape}. Received: shape {np.shape(edge)}")

        self._warn_outside_ranges(times, indentations, tabor)
        sequence = self.scaling.scale_channels(
            channels(times, indentations, np.asarray(edge, dtype=np.float64), self.scaling.features)
        )
        return self.predict_channels(sequence, self.scaling.scale_tabor(tabor))

    def predict_channels(self, sequence: np.ndarray, tabor: np.ndarray) -> np.ndarray:
        """Predict the force from scaled channels of shape `(batch, steps, channels)` and scaled Tabor `(batch, 1)`.

        Raises:
            ValueError: a wrong number of channels, or NaN.
        """
        expected = self.model.inputs[0].shape[-1]
        if np.ndim(sequence) != 3 or np.shape(sequence)[-1] != expected:
            raise ValueError(
                f"Expected channels of shape (batch, steps, {expected}) for {self.name}. "
                f"Received: shape {np.shape(sequence)}"
            )
        if not np.isfinite(sequence).all():
            raise ValueError("Expected finite channels. Received: NaN or infinity")
        return self.scaling.unscale_force(predict_scaled(self.model, sequence, tabor))

    def _warn_outside_ranges(self, times: np.ndarray, indentations: np.ndarray, tabor: np.ndarray) -> None:
        quantities = {"tabor": tabor, **_protocol_quantities(times, indentations)}
        outside = []
        for name, (low, high) in self.scaling.ranges.items():
            values = quantities[name][np.isfinite(quantities[name])]
            slack = RANGE_TOLERANCE * max(abs(low), abs(high))
            beyond = np.maximum(low - values, values - high)
            if values.size and beyond.max() > slack:
                worst = values[beyond.argmax()]
                outside.append(f"{name} = {worst:.6g} lies outside [{low:.6g}, {high:.6g}]")
        if outside:
            message = f"{self.name} extrapolates beyond its training: {'; '.join(outside)}"
            warnings.warn(message, ExtrapolationWarning, stacklevel=3)


def load_weights(model: keras.Model, path: Path) -> None:
    """Read weights into a model.

    Raises:
        ValueError: the file holds other weights than the model has.
    """
    expected = f"Expected weights of {model.name} with {model.count_params()} parameters"
    try:
        # Keras leaves weights of layers the model lacks unread, without a word.
        with h5py.File(path, "r") as file:
            sizes = []
            file.visititems(lambda _, item: sizes.append(item.size) if isinstance(item, h5py.Dataset) else None)
        if sum(sizes) != model.count_params():
            raise ValueError(f"{sum(sizes)} parameters")
        model.load_weights(path)
    except (ValueError, KeyError, OSError) as error:
        reason = str(error).splitlines()[0]
        raise ValueError(f"{expected}. Received: {path} ({reason})") from error


def _protocol_quantities(times: np.ndarray, indentations: np.ndarray) -> dict[str, np.ndarray]:
    """Recover peak, rates and dwell time of every history; NaN where a phase is absent."""
    rows = []
    for time, indentation in zip(times, indentations, strict=True):
        peak = int(np.argmax(indentation))
        onset, end = plateau(indentation) or (peak, peak)
        loading = (indentation[onset] - indentation[0]) / (time[onset] - time[0]) if onset else np.nan
        last = len(time) - 1
        unloading = (indentation[end] - indentation[last]) / (time[last] - time[end]) if end < last else np.nan
        rows.append((indentation[peak], loading, time[end] - time[onset], unloading))
    keys = ("peak_indentation", "loading_rate", "dwell_time", "unloading_rate")
    return dict(zip(keys, np.array(rows).T, strict=True))


def _check_history(times: np.ndarray, indentations: np.ndarray) -> None:
    if times.ndim != 2 or times.shape != indentations.shape or times.size == 0:
        raise ValueError(
            "Expected times and indentations of one shape (batch, steps). "
            f"Received: times of shape {times.shape}, indentations of shape {indentations.shape}"
        )
    for name, values in (("times", times), ("indentations", indentations)):
        bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if bad.size:
            raise ValueError(f"Expected finite {name}. Received: NaN or infinity in history {bad[0]}")
    bad = np.flatnonzero((np.diff(times, axis=1) <= 0).any(axis=1))
    if bad.size:
        step = int(np.argmax(np.diff(times[bad[0]]) <= 0)) + 1
        raise ValueError(
            "Expected times that increase strictly. "
            f"Received: {times[bad[0], step]!r} after {times[bad[0], step - 1]!r} in history {bad[0]}"
        )


def _find(name: str | Path, root: Path) -> Path:
    folder = Path(name)
    if folder.is_dir() and (folder / "run.json").is_file():
        return folder
    if (root / name).is_dir():
        return root / name
    trained = sorted(path.parent.name for path in root.glob("*/run.json"))
    if isinstance(name, Path) or "/" in str(name):
        raise FileNotFoundError(f"Expected a model directory. Received: {name}")
    if name not in names():
        known = sorted({*names(), *trained})
        raise ValueError(f"Unknown model name. Expected one of {', '.join(known)}. Received: name={name!r}")
    raise FileNotFoundError(
        f"No trained {name} in {root}; train it with `surrogate train {name}`. "
        f"Trained there: {', '.join(trained) or 'none'}"
    )


def _existing(path: Path) -> Path:
    if not path.is_file():
        raise FileNotFoundError(f"Expected a complete model directory. Missing: {path}")
    return path
