"""`fast` and `accurate` for users: protocols and material in, trajectories with bands out.

Examples:
    >>> import surrogate
    >>> from bem import LoadingProtocol
    >>> model = surrogate.load("fast")  # doctest: +SKIP
    >>> protocol = LoadingProtocol(peak_indentation=20.0, loading_rate=10.0, dwell_time=1.0, unloading_rate=10.0)
    >>> (found,) = model.trajectories(protocol, tabor=1.0, modulus_ratio=0.1)  # doctest: +SKIP
    >>> found.pull_off_force, found.pull_off_interval  # doctest: +SKIP
"""

from __future__ import annotations

import json
import time
import warnings
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bem._support.validation import finite_number
from bem._support.wording import shown
from bem.protocol import LoadingProtocol
from bem.trajectory import Statistics
from surrogate.data.scaling import Scaling
from surrogate.inference.checks import checked_modulus_ratio, checked_tabor
from surrogate.inference.model_files import existing
from surrogate.inference.validity import (
    Excess,
    ExtrapolationWarning,
    excesses,
    of_history,
    start_range,
    warn_of_extrapolation,
    worst,
)
from surrogate.pretrained.banded import BandedTrajectory, without_bands
from surrogate.pretrained.bands import LARGEST_COVERAGE, LEVELS, Bands
from surrogate.pretrained.network import BATCH, Network

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from surrogate.pretrained.streaming import PretrainedStream

NAMES = ("accurate", "fast")
PUBLISHED = Path(__file__).resolve().parents[2] / "published" / "pretrained"
PACKAGED = Path(__file__).resolve().parent / "models"
FILES = ("model.onnx", "scaling.json", "bands.npz", "run.json")
"""What a folder of a pretrained model must hold."""

QUANTITIES = ("tabor", "peak_indentation", "loading_rate", "dwell_time", "unloading_rate", "modulus_ratio")


class Pretrained:
    """A pretrained model.

    Args:
        folder: Where its files are.
        threads: Threads of ONNX Runtime.

    Raises:
        FileNotFoundError: a file is missing.
        ValueError: a file is damaged.
    """

    def __init__(self, folder: Path, threads: int = 1) -> None:
        for name in FILES:
            existing(folder / name)
        self.folder, self.name = folder, folder.name
        self.scaling = Scaling.load(folder / "scaling.json")
        self.network = Network(folder / "model.onnx", threads)
        try:
            self.run = json.loads((folder / "run.json").read_text(encoding="utf-8"))
            self.counts = np.array(self.run["counts"], dtype=np.int64)
            with np.load(folder / "bands.npz") as arrays:
                self.bands = Bands(**{name: arrays[name].astype(np.float64) for name in arrays.files})
        except (ValueError, KeyError, TypeError, OSError) as error:
            raise ValueError(f"Expected a folder of `make pretrained`. Received: {folder}, damaged") from error
        moments = [*zip(self.scaling.channel_mean, self.scaling.channel_scale, strict=True), self.scaling.tabor]
        self._mean, self._scale = np.array(moments).T.copy()
        self._low, self._high = np.array([self.ranges[name] for name in QUANTITIES]).T.copy()
        # What does not differ between trajectories they share, read-only.
        steps = int(self.counts.sum())
        self._radius, self._unloading = np.full(steps, np.nan), np.arange(steps) >= self.counts[:2].sum() - 1
        self._radius.flags.writeable = self._unloading.flags.writeable = False

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Smallest and largest value of each quantity in the training, by name."""
        return self.scaling.ranges

    def parts(self) -> dict[str, Any]:
        """Return what `surrogate.export.pretrained.file_content` makes one file of, by argument."""
        return {
            "name": self.name,
            "network": (self.folder / "model.onnx").read_bytes(),
            "scaling": self.scaling,
            "counts": self.counts.tolist(),
            "bands": {"levels": LEVELS} | self.bands.as_arrays(),
        }

    def trajectories(
        self,
        protocols: Sequence[LoadingProtocol] | LoadingProtocol,
        *,
        tabor: ArrayLike,
        modulus_ratio: ArrayLike,
        coverage: float = 0.9,
    ) -> list[BandedTrajectory]:
        """Predict whole trajectories of loading protocols on standard linear solids.

        Args:
            protocols: One protocol or many. One without a dwell is computed with the shortest dwell of the training.
            tabor: One Tabor parameter per protocol, or one for all.
            modulus_ratio: One modulus ratio per protocol, or one for all, in (0, 1].
            coverage: Share of true values that the bands are to contain, up to 0.99.

        Returns:
            One trajectory per protocol, in order.

        Raises:
            ValueError: something else than loading protocols, numbers that do not fit or are out of bounds, or a
                protocol that does not start below zero and press above it.

        Warns:
            ExtrapolationWarning: once, where protocols leave the ranges of the training; their bands are infinite.
        """
        clock = time.perf_counter()
        protocols = list(protocols) if isinstance(protocols, Iterable) else [protocols]
        for protocol in protocols:
            if not isinstance(protocol, LoadingProtocol):
                raise ValueError(f"Expected LoadingProtocols. Received: {shown(protocol)}")
        coverage = finite_number("coverage", coverage, above=0.0, high=LARGEST_COVERAGE)
        mu, ratio = checked_tabor(tabor, len(protocols)), checked_modulus_ratio(modulus_ratio, len(protocols))
        if not protocols:
            return []
        paths = np.array([(p.peak_indentation, p.loading_rate, p.dwell_time, p.unloading_rate) for p in protocols])
        start = np.array([p.start(tabor) for p, tabor in zip(protocols, mu.tolist(), strict=True)])
        quantities = np.column_stack([mu, paths, ratio])
        outside = self._excesses(quantities, start)
        quantities[:, 3] = np.maximum(quantities[:, 3], self.scaling.ranges["dwell_time"][0])
        parts = [
            self._computed(quantities[at : at + BATCH], start[at : at + BATCH], coverage)
            for at in range(0, len(quantities), BATCH)
        ]
        extrapolated: dict[int, tuple[str, ...]] = {}
        if outside:
            rows = np.flatnonzero(np.any([excess.beyond > 0.0 for excess in outside], axis=0))
            extrapolated = {int(row): of_history(outside, row) for row in rows}
            warnings.warn(
                f"{len(rows)} of {len(protocols)} protocols lie outside the training of {self.name}, and their bands "
                f"are infinite: {', '.join(worst(outside))}",
                ExtrapolationWarning,
                stacklevel=2,
            )
        stats = Statistics(seconds=(time.perf_counter() - clock) / len(protocols))
        found = [one for part in parts for one in self._trajectories(part, coverage, stats)]
        for row, words in extrapolated.items():
            found[row] = without_bands(found[row], words)
        return found

    def stream(self, *, tabor: float, modulus_ratio: float) -> PretrainedStream:
        """Return a stream, which predicts point by point, for a Tabor parameter and a modulus ratio in (0, 1].

        Raises:
            ValueError: one of them is out of bounds; an `ExtrapolationWarning` names what the training did not contain.
        """
        from surrogate.pretrained.streaming import PretrainedStream

        solid = {"tabor": checked_tabor(tabor, 1), "modulus_ratio": checked_modulus_ratio(modulus_ratio, 1)}
        warn_of_extrapolation(self.name, excesses(solid, self.scaling.ranges))
        return PretrainedStream(self, **{name: float(value[0]) for name, value in solid.items()})

    def _excesses(self, quantities: np.ndarray, start: np.ndarray) -> list[Excess]:
        """What lies outside the training; two comparisons answer first for a single protocol, which lies inside."""
        low, high = start_range(quantities[:, 0])
        if (
            (self._low <= quantities).all()
            and (quantities <= self._high).all()
            and ((low <= start) & (start <= high)).all()
        ):
            return []
        named = dict(zip(QUANTITIES, quantities.T, strict=True))
        return excesses({**named, "start_indentation": start}, self.ranges)

    def _computed(self, quantities: np.ndarray, start: np.ndarray, coverage: float) -> dict[str, np.ndarray]:
        """All arrays of one batch, histories first."""
        # Compiled, so imported by the first call.
        from bem.dataset.physical_steps import checked_steps, solids
        from surrogate.pretrained.kernels import results, scaled_inputs

        tabor, ratio = (np.ascontiguousarray(quantities[:, column]) for column in (0, 5))
        protocols = np.array([*quantities[:, :5].T, start])
        times, indentations = checked_steps(protocols, *solids(ratio), self.counts)
        inputs = scaled_inputs(times, indentations, tabor, ratio, self.counts, self._mean, self._scale)
        scaled = self.network(inputs).astype(np.float64)
        force = self.scaling.unscale_force(scaled)
        pull_off, instant, sharpness, work = results(times, indentations, force, self.counts)
        known = np.column_stack([quantities, sharpness])
        log_width, width = self.bands.widths(known, coverage)
        return {
            "time": times,
            "indentation": indentations,
            "force": force,
            "force_lower": self.scaling.unscale_force(scaled - width),
            "force_upper": self.scaling.unscale_force(scaled + width),
            "ratio": ratio,
            "results": np.column_stack([pull_off, instant, work]),
            "interval": pull_off[:, np.newaxis] * np.exp(log_width[:, np.newaxis] * [-1.0, 1.0]),
        }

    def _trajectories(
        self, part: dict[str, np.ndarray], coverage: float, stats: Statistics
    ) -> Iterator[BandedTrajectory]:
        """One trajectory after the other."""
        histories = (part[name] for name in ("time", "indentation", "force", "force_lower", "force_upper"))
        numbers = (part[name].tolist() for name in ("interval", "results", "ratio"))
        for time_, indentation, force, lower, upper, interval, results, ratio in zip(*histories, *numbers, strict=True):
            yield BandedTrajectory(
                time=time_,
                indentation=indentation,
                force=force,
                contact_radius=self._radius,
                status="completed",
                jumps=(),
                stats=stats,
                accuracy=np.nan,
                unloading=self._unloading,
                model=self.name,
                modulus_ratio=ratio,
                coverage=coverage,
                pull_off_interval=tuple(interval),
                force_lower=lower,
                force_upper=upper,
                results=tuple(results),
            )


def find(name: str, root: str | Path | None = None) -> Path:
    """Return the folder of a pretrained model.

    Raises:
        FileNotFoundError: it is not there.
    """
    places = [Path(root)] if root is not None else [PUBLISHED, Path("published/pretrained").absolute(), PACKAGED]
    for place in places:
        if (place / name / "run.json").is_file():
            return place / name
    raise FileNotFoundError(
        f"Expected the pretrained model {name} in {' or '.join(map(str, places))}; `make pretrained` trains it. "
        "Received: a name without a model"
    )
