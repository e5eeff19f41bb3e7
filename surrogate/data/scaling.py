"""Scaling of the network's inputs and output: a symmetric logarithm, then standardisation.

Source: the paper's section "Surrogate-model inputs and targets". With symlog(x) = sign(x) log(1 + |x|), time is
transformed twice; indentation, Tabor parameter and force are transformed once. The paper does not say how velocity and
acceleration are transformed; both span decades, so they are transformed once here. The edge is not transformed. Each
channel, the Tabor parameter and the force are then standardised: the mean of the *training* set is subtracted, and the
difference is divided by its standard deviation.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from bem._support.text_files import parse_json, read_text
from bem._support.wording import shortened
from surrogate.data.features import channel_names

FORMAT = "viscoelastic-contact-scaling"
FORMAT_VERSION = 1
MOMENTS = ("channel_mean", "channel_scale", "tabor", "force")

PUBLISHED_MATERIALS = {"a8108732dbfcd7ea64fe9a88fbd16d06bb0ff632fdfa3f3fb03347a9501e7586": 0.1}
"""Modulus ratio by `TrajectoryDataset.sha256`, for models whose `ranges` were saved without the modulus ratio."""

SYMLOG_PASSES = {"time": 2, "indentation": 1, "velocity": 1, "acceleration": 1, "edge": 0}
"""How many times each channel is transformed by `symlog`."""


def symlog(values: np.ndarray) -> np.ndarray:
    """Return sign(x) log(1 + |x|) element by element; it is linear near zero and logarithmic far from zero."""
    return np.copysign(np.log1p(np.abs(values)), values)


def symexp(values: np.ndarray) -> np.ndarray:
    """Return sign(y) (exp(|y|) - 1) element by element, the inverse of `symlog`; infinite where y is above some 700."""
    with np.errstate(over="ignore"):
        return np.copysign(np.expm1(np.abs(values)), values)


@dataclass(frozen=True)
class Scaling:
    """Statistics of a training set, and the maps between physical and scaled quantities.

    Args:
        features: Feature set of the channels (`surrogate.data.features`).
        channel_mean: Mean of each transformed channel.
        channel_scale: Standard deviation of each transformed channel.
        tabor: Mean and standard deviation of the transformed Tabor parameter.
        force: Mean and standard deviation of the transformed force.
        ranges: Smallest and largest value in the training set of each protocol quantity, and of the modulus ratio if
            the data set states it, by name.
        dataset_sha256: Digest of the data set, `TrajectoryDataset.sha256`.
    """

    features: str
    channel_mean: tuple[float, ...]
    channel_scale: tuple[float, ...]
    tabor: tuple[float, float]
    force: tuple[float, float]
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)
    dataset_sha256: str = ""

    @classmethod
    def fit(
        cls,
        channels: np.ndarray,
        *,
        tabor: np.ndarray,
        force: np.ndarray,
        features: str = "D",
        protocols: Mapping[str, np.ndarray] | None = None,
        dataset_sha256: str = "",
    ) -> Scaling:
        """Compute the statistics of training trajectories.

        Args:
            channels: Physical channels of shape `(batch, steps, channels)`.
            tabor: Tabor parameters of shape `(batch,)`.
            force: Physical forces of shape `(batch, steps)`.
            features: Feature set of `channels`.
            protocols: Arrays by name, each of any shape; their smallest and largest values become `ranges`.
            dataset_sha256: Digest of the data set, `TrajectoryDataset.sha256`.

        Returns:
            The scaling.

        Raises:
            ValueError: the feature set is unknown, or the number of channels is not that of the feature set.
        """
        mean, scale = _moments(_transformed(channels, features), axis=(0, 1))
        return cls(
            features=features,
            channel_mean=tuple(mean.tolist()),
            channel_scale=tuple(scale.tolist()),
            tabor=_scalar_moments(tabor),
            force=_scalar_moments(force),
            ranges={name: (float(v.min()), float(v.max())) for name, v in (protocols or {}).items()},
            dataset_sha256=dataset_sha256,
        )

    @property
    def modulus_ratio(self) -> float | None:
        """Modulus ratio of the training set's material; `None` if it is unknown or not the same in all trajectories."""
        low, high = self.ranges.get("modulus_ratio", [PUBLISHED_MATERIALS.get(self.dataset_sha256)] * 2)
        return low if low == high else None

    @cached_property
    def _channel_moments(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array(self.channel_mean), np.array(self.channel_scale)

    def scale_channels(self, channels: np.ndarray) -> np.ndarray:
        """Return scaled channels, float32, of the same shape as the physical ones, `(..., steps, channels)`.

        Raises:
            ValueError: the number of channels is not that of the feature set.
        """
        mean, scale = self._channel_moments
        return ((_transformed(channels, self.features) - mean) / scale).astype(np.float32)

    def scale_tabor(self, tabor: np.ndarray) -> np.ndarray:
        """Return scaled Tabor parameters of shape `(batch, 1)`, float32, from physical ones of shape `(batch,)`."""
        mean, scale = self.tabor
        return ((symlog(np.asarray(tabor, dtype=np.float64)) - mean) / scale).astype(np.float32).reshape(-1, 1)

    def scale_force(self, force: np.ndarray) -> np.ndarray:
        """Return scaled forces, float64, of the same shape as the physical ones."""
        mean, scale = self.force
        return (symlog(np.asarray(force, dtype=np.float64)) - mean) / scale

    def unscale_force(self, scaled: np.ndarray) -> np.ndarray:
        """Return physical forces, float64, of the same shape as the scaled ones; the inverse of `scale_force`."""
        mean, scale = self.force
        return symexp(np.asarray(scaled, dtype=np.float64) * scale + mean)

    def to_json(self) -> str:
        """Return the scaling as JSON; `from_json` reads the same floats back."""
        return json.dumps({"format": FORMAT, "format_version": FORMAT_VERSION, **asdict(self)}, indent=1)

    @classmethod
    def from_json(cls, text: str, source: str | Path) -> Scaling:
        """Read a scaling from the JSON that `to_json` returns.

        Args:
            text: The JSON.
            source: Name or path of its origin, for error messages.

        Returns:
            The scaling.

        Raises:
            ValueError: the text is not a scaling, or its channels do not match its feature set.
        """
        try:
            stored = parse_json(text)
            if (stored.pop("format"), stored.pop("format_version")) != (FORMAT, FORMAT_VERSION):
                raise KeyError("format")
            ranges = {name: (float(low), float(high)) for name, (low, high) in stored["ranges"].items()}
            moments: dict[str, Any] = {name: tuple(map(float, stored[name])) for name in MOMENTS}
            scaling = cls(stored["features"], **moments, ranges=ranges, dataset_sha256=stored["dataset_sha256"])
            if {len(channel_names(scaling.features))} != {len(scaling.channel_mean), len(scaling.channel_scale)}:
                raise ValueError("moments of other channels than those of the feature set")
        except (ValueError, AttributeError, KeyError, TypeError, OverflowError) as error:
            why = shortened(str(error))
            raise ValueError(
                f"a scaling must be a {FORMAT} file of version {FORMAT_VERSION}; received {source} ({why})"
            ) from error
        return scaling

    def save(self, path: str | Path) -> None:
        """Write the scaling as JSON."""
        Path(path).write_text(self.to_json() + "\n", encoding="utf-8")

    @classmethod
    def load(cls, path: str | Path) -> Scaling:
        """Read a scaling that `save` wrote.

        Raises:
            FileNotFoundError: the file does not exist.
            ValueError: the file is not a scaling, or its channels do not match its feature set.
        """
        try:
            text = read_text(path)
        except ValueError as error:
            raise ValueError(f"a scaling must be a {FORMAT} file; received {path} ({error})") from error
        return cls.from_json(text, source=path)


def _transformed(channels: np.ndarray, features: str) -> np.ndarray:
    """Return channels of shape `(..., steps, channels)` before they are standardised, float64."""
    names = channel_names(features)
    if channels.shape[-1] != len(names):
        raise ValueError(
            f"channels must be {len(names)} ({', '.join(names)}) for feature set {features}; "
            f"received an array of shape {channels.shape}"
        )
    values = np.array(channels, dtype=np.float64)
    for column, name in enumerate(names):
        for _ in range(SYMLOG_PASSES[name]):
            values[..., column] = symlog(values[..., column])
    return values


def _moments(transformed: np.ndarray, axis: tuple[int, ...] | None = None) -> tuple[np.ndarray, np.ndarray]:
    mean, scale = transformed.mean(axis=axis), transformed.std(axis=axis)
    # A channel whose variation is rounding error carries no information. Its scale is one, so that it becomes zero.
    return mean, np.where(scale > 1e-12 * (1.0 + np.abs(mean)), scale, 1.0)


def _scalar_moments(values: np.ndarray) -> tuple[float, float]:
    mean, scale = _moments(symlog(np.asarray(values, dtype=np.float64)))
    return float(mean), float(scale)
