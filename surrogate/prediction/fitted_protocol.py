"""Load-dwell-unload protocol that was fitted to a measured history; units as in `bem.protocol`."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bem.dataset.measurement_steps import FMS, measurement_grid


@dataclass(frozen=True)
class FittedProtocol:
    """A path of two straight ramps with a dwell between them.

    Args:
        corners: Times of start, first and last point of the dwell, and end, shape `(4,)`. Without a dwell, the two in
            the middle are equal.
        start_indentation: Indentation at the start.
        peak_indentation: Indentation during the dwell.
        end_indentation: Indentation at the end.
        residual: Root mean square difference between the indentations of the history and the path.
        exact: Whether the points of the history lie on the path up to rounding.
    """

    corners: np.ndarray
    start_indentation: float
    peak_indentation: float
    end_indentation: float
    residual: float
    exact: bool

    @property
    def loading_rate(self) -> float:
        """Rate of indentation in loading."""
        return float((self.peak_indentation - self.start_indentation) / (self.corners[1] - self.corners[0]))

    @property
    def dwell_time(self) -> float:
        """Duration of the dwell."""
        return float(self.corners[2] - self.corners[1])

    @property
    def unloading_rate(self) -> float:
        """Rate of indentation in unloading, as a positive number."""
        return float((self.peak_indentation - self.end_indentation) / (self.corners[3] - self.corners[2]))

    @property
    def travel(self) -> float:
        """Difference between the peak and the lowest indentation."""
        return self.peak_indentation - min(self.start_indentation, self.end_indentation)

    def with_dwell(self, dwell_time: float) -> FittedProtocol:
        """Return the path with a longer dwell of the same middle.

        Each ramp gives at most a tenth of its duration to the dwell, which may then be shorter than `dwell_time`.
        """
        begin, first, second, end = self.corners
        half = 0.5 * (dwell_time - self.dwell_time)
        first, second = first - min(half, 0.1 * (first - begin)), second + min(half, 0.1 * (end - second))
        return replace(self, corners=np.array([begin, first, second, end]))

    def summary(self) -> dict[str, float]:
        """Return the quantities of the protocol and the residual by name, ready for JSON."""
        names = ("start_indentation", "peak_indentation", "end_indentation", "loading_rate", "dwell_time")
        return {name: float(getattr(self, name)) for name in (*names, "unloading_rate", "residual")}

    def levels(self) -> np.ndarray:
        """Return the indentations at the corners, shape `(4,)`."""
        return np.array([self.start_indentation, *[self.peak_indentation] * 2, self.end_indentation])

    def measurement_steps(self) -> tuple[np.ndarray, np.ndarray]:
        """Return times and indentations of the fixed measurement steps, each of shape `(120,)`.

        Raises:
            ValueError: the path has no dwell.
        """
        unit = {"tabor": 1.0, "start_indentation": 0.0, "peak_indentation": 1.0}
        rates = {"loading_rate": 1.0, "dwell_time": float(self.dwell_time > 0.0), "unloading_rate": 1.0}
        (phase,), _ = measurement_grid(**unit, **rates, counts=FMS)
        return np.interp(phase, range(4), self.corners), np.interp(phase, range(4), self.levels())

    def words(self) -> str:
        """Return the path and its residual as one line of text."""
        return (
            f"from {self.start_indentation:.4g} to {self.peak_indentation:.4g} at {self.loading_rate:.4g}, dwell "
            f"{self.dwell_time:.4g}, to {self.end_indentation:.4g} at {self.unloading_rate:.4g}; the points differ by "
            f"{self.residual:.2g} (rms), {100.0 * self.residual / self.travel:.2g} % of its travel"
        )
