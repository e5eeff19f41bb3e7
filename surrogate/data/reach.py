"""What the training of a model of any linear solid covers: the range of each feature, and all features together.

A contact may have every feature in its range and yet a combination of them that no training had, as the spectrum of
polyurea did. The distance of Mahalanobis, in the covariance of the training, measures that; how far the training itself
reaches is a quantile of its own distances.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from surrogate.data.solid_features import FEATURES, PLAIN

TOLERANCE, MARGIN = 1e-3, 0.1
"""How far outside its range a feature may lie, in widths of it: as inside, and with a warning."""
QUANTILE = 0.9995
"""Share of the training that is not farther than the limit of the distance."""
FARTHEST = 1.5
"""Distance, over its limit, beyond which a contact is refused."""
_RIDGE = 1e-4  # added to the variance of each standardised combination of features


@dataclass(frozen=True)
class Reach:
    """Ranges of features, and the distance from their mean.

    Args:
        low, high: Of each feature in the training, shape (n,).
        mean: Of the features, shape (n,).
        whitening: What turns their differences from it into uncorrelated ones of variance one, shape (n, n).
        limit: Distance that the share `QUANTILE` of the training does not exceed, shape ().
    """

    low: np.ndarray
    high: np.ndarray
    mean: np.ndarray
    whitening: np.ndarray
    limit: np.ndarray

    @classmethod
    def of(cls, features: np.ndarray) -> Reach:
        """What features (batch, n) of a training cover."""
        mean, deviation = features.mean(axis=0), features.std(axis=0) + 1e-9
        variances, directions = np.linalg.eigh(np.cov(((features - mean) / deviation).T))
        whitening = directions / np.sqrt(np.maximum(variances, 0.0) + _RIDGE) / deviation[:, np.newaxis]
        own = cls(features.min(axis=0), features.max(axis=0), mean, whitening, np.array(1.0))
        limit = np.quantile(own.distances(features), QUANTILE)
        return cls(own.low, own.high, mean, whitening, limit)

    def distances(self, features: np.ndarray) -> np.ndarray:
        """Distances of features (batch, n) from the mean, over the limit, shape (batch,)."""
        white = (features - self.mean) @ self.whitening
        return np.sqrt(np.einsum("ij,ij->i", white, white) / white.shape[1]) / self.limit

    def outside(self, features: np.ndarray) -> list[tuple[tuple[str, ...], bool]]:
        """What of each contact lies outside the training, as text, and whether it does by far."""
        distances = self.distances(features)
        results: list[tuple[tuple[str, ...], bool]] = [((), False)] * len(features)
        if ((features >= self.low) & (features <= self.high)).all() and distances.max() <= 1.0:  # nearly always
            return results
        width = np.maximum(self.high - self.low, 1e-9)
        excess = np.maximum(self.low - features, features - self.high) / width
        for row in np.flatnonzero((excess.max(axis=1) > TOLERANCE) | (distances > 1.0)):
            texts = [
                _words(at, features[row, at], self.low[at], self.high[at])
                for at in np.flatnonzero(excess[row] > TOLERANCE)
            ]
            if distances[row] > 1.0:
                texts.append(f"features {distances[row]:.2f} times as far from the mean as those of the training")
            results[row] = (tuple(texts), bool(excess[row].max() > MARGIN or distances[row] > FARTHEST))
        return results


def _words(at: int, *values: float) -> str:
    """Name of a feature, its value and its range; the first ones as users know them."""
    name = FEATURES[at] if at < PLAIN else f"feature {FEATURES[at]}"
    value, low, high = np.exp(values) if at < PLAIN else values
    return f"{name} {value:.4g}, outside {low:.3g} to {high:.3g}"
