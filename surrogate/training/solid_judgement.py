r"""Calibrate a model of any linear solid, and judge it, against the converged solver.

    bem campaign --solids prony:1-4 --design sobol --modulus-ratio 0.01:1 --steps pull-off --accuracy 1e-3 \
        --count 6000 --seed 176 --out calibration.h5
    python -m surrogate.training.solid_judgement MODEL --fit fit.h5 --calibrate calibration.h5
    python -m surrogate.training.solid_judgement MODEL --judge test.h5

The expected errors are fitted to `--fit`, at the accuracy of the training: on the training itself errors are too small,
most where it is sparse. Those trajectories, and those of `--calibrate` and `--judge`, come from seeds that no training
saw. Each file of `--judge` is a place: a kind of solids, corners, edges. What it finds is written to `errors.json` in
the folder of the model.
"""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from collections.abc import Sequence
from itertools import pairwise, product
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from bem._support.outputs import write_whole
from bem._support.provenance import provenance
from bem.dataset.designs import OUTERMOST
from bem.dataset.file import Dataset, load_dataset
from surrogate.intervals import BANDS, SolidIntervals, kinds_of
from surrogate.solids import SCALARS, SolidSurrogate, force_units, scalar_targets, write_intervals

COVERAGES = (0.5, 0.9)
QUANTILES = (0.5, 0.9, 0.99)
RESULTS = ("pull-off force", "time since the dwell", "hysteresis", "largest compression")
"""Words for `SCALARS`."""
ERRORS = "errors.json"
"""What `--judge` writes into the folder of a model."""
FITTED = 40_000
"""Trajectories at most to which the expected errors are fitted."""


def compared(model: SolidSurrogate, dataset: Dataset, rows: np.ndarray) -> dict[str, np.ndarray]:
    """Predictions of some trajectories of a data set, with the `errors` (batch, 4) of their targets.

    Returns:
        What `SolidSurrogate.predict_many` does, and `errors`, `curve_errors`, `kinds`, the true `SCALARS` as
        `true_...` and the `true_force` at the predicted steps.
    """
    protocols = {name: values[rows] for name, values in dataset.protocols.items()}
    strengths, times = (values[rows] for values in dataset.solids)
    prediction = model.predict_many(protocols, strengths, times)
    true = {name: dataset.scalars[name][rows] for name in SCALARS}
    begin = dataset.grid()[0][rows, sum(dataset.counts[:2]) - 1]
    prediction["errors"] = prediction["targets"] - scalar_targets(true, begin, protocols["unloading_rate"])
    prediction["kinds"] = kinds_of(strengths, times)
    force = prediction["true_force"] = _force_at(prediction["times"], dataset, rows)
    units = force_units(force, prediction["pull_off_force"], dataset.counts)
    prediction["curve_errors"] = np.arcsinh(prediction["force"] / units) - np.arcsinh(force / units)
    return prediction | {f"true_{name}": values for name, values in true.items()} | {"begin": begin}


def calibrate(folder: Path, fitted: Sequence[Path], calibrating: Sequence[Path]) -> None:
    """Fit expected errors, take the quantiles of the calibration, and write both into the folder of a model."""
    model = SolidSurrogate.load(folder)
    intervals: SolidIntervals | None = None
    for paths, most in ((fitted, FITTED // len(fitted)), (calibrating, None)):
        parts = []
        for path in paths:
            dataset = load_dataset(path)
            parts.append(compared(model, dataset, dataset.completed[:most]))
        features, kinds, *errors = (
            np.concatenate([part[name] for part in parts]) for name in ("features", "kinds", "errors", "curve_errors")
        )
        if intervals is None:
            intervals = SolidIntervals.fit(features, *errors)
        else:
            intervals = intervals.calibrated(features, kinds, *errors)
    write_intervals(folder, intervals)


def judged(model: SolidSurrogate, path: Path) -> dict[str, dict[str, float]]:
    """Errors in per cent at `QUANTILES`, and coverages in per cent, of a data set.

    They are those of contacts that the model takes without a warning; their share is there too. Those of hysteresis
    and compression are relative to them, or to 1 where they are less; those of the curve relative to its range, the
    mean and the largest over the instants of unloading and all others. There are the coverages at each of the `ends`
    of the ranges, too.
    """
    dataset = load_dataset(path)
    rows = dataset.completed
    part = compared(model, dataset, rows)
    inside = np.array([not texts for texts, _ in model.reach.outside(part["features"])])
    rows, part = rows[inside], {name: values[inside] for name, values in part.items()}
    true = {name: part[f"true_{name}"] for name in SCALARS}
    since = [part["pull_off_time"] - part["begin"], true["pull_off_time"] - part["begin"]]
    compression = np.abs(part["max_compression"] - true["max_compression"])
    differences = np.abs(part["force"] - part["true_force"])
    extent = np.ptp(dataset.force[rows], axis=1)
    results = (
        np.abs(part["pull_off_force"] / true["pull_off_force"] - 1.0),
        np.abs(since[0] / since[1] - 1.0),
        np.abs(part["hysteresis"] - true["hysteresis"]) / np.maximum(true["hysteresis"], 1.0),
        compression / np.maximum(np.abs(true["max_compression"]), 1.0),
    )
    errors = dict(zip(RESULTS, results, strict=True)) | {
        "curve, mean": differences.mean(axis=1) / extent,
        "curve, largest": differences.max(axis=1) / extent,
    }
    table = {
        name: {f"{100 * level:g}": 100.0 * float(np.quantile(values, level)) for level in QUANTILES}
        for name, values in errors.items()
    }
    bias = part["pull_off_force"] / true["pull_off_force"] - 1.0
    table["pull-off force"]["bias"] = 100.0 * float(np.median(bias))
    members = ends(dataset, rows)
    for coverage in COVERAGES:
        for name, covered in _covered(model, part, coverage).items():
            table.setdefault(name, {})[f"covered at {coverage:g}"] = 100.0 * float(covered.mean())
            for end, own in members.items() if coverage == COVERAGES[-1] else ():
                share = 100.0 * float(covered[own].mean()) if own.any() else np.nan
                table.setdefault(f"at {end}", {"count": float(own.sum())})[name] = share
    return table | {"trajectories": {"count": len(inside), "inside": 100.0 * float(inside.mean())}}


def _covered(model: SolidSurrogate, part: dict[str, np.ndarray], coverage: float) -> dict[str, np.ndarray]:
    """Which true results lie in their intervals, what share of the steps and which whole curves in their bands.

    Returns:
        Arrays (batch,) by the names of `RESULTS` and `BANDS`; none of a model without intervals.
    """
    if model.intervals is None:
        return {}
    half, shape = model.intervals.half_widths(part["features"], part["kinds"], coverage)
    results = np.abs(part["errors"]) <= half[:, : len(RESULTS)]
    steps, curves = (
        np.abs(part["curve_errors"]) <= shape * half[:, len(RESULTS) + band, np.newaxis] for band in range(len(BANDS))
    )
    covered = [*results.T, steps.mean(axis=1), curves.all(axis=1)]
    return dict(zip((*RESULTS, *BANDS), covered, strict=True))


def ends(dataset: Dataset, rows: np.ndarray) -> dict[str, np.ndarray]:
    """Which contacts (batch,) of a design of edges or corners lie at each end of a range, or in each corner, by name.

    An end is the outermost fifth of a range, in its logarithm, a corner one of each range.
    """
    campaign = dataset.attributes["campaign"]
    if campaign["design"] not in ("edges", "corners"):
        return {}
    pairs = []
    for name, drawn in (campaign["ranges"] | {"modulus_ratio": campaign["modulus_ratio"]}).items():
        low, high = np.broadcast_to(drawn, 2)
        values = dataset.modulus_ratios if name == "modulus_ratio" else dataset.protocols[name]
        share = np.log(values[rows] / low) / np.log(high / low)
        pairs.append({f"low {name}": share <= OUTERMOST, f"high {name}": share >= 1.0 - OUTERMOST})
    if campaign["design"] == "edges":
        return {end: members for pair in pairs for end, members in pair.items()}
    return {
        ", ".join(corner): np.all([p[end] for p, end in zip(pairs, corner, strict=True)], axis=0)
        for corner in product(*pairs)
    }


def _force_at(times: np.ndarray, dataset: Dataset, rows: np.ndarray) -> np.ndarray:
    """True forces of some trajectories at instants (batch, steps), interpolated phase by phase."""
    phases = [slice(max(begin - 1, 0), end) for begin, end in pairwise(np.cumsum([0, *dataset.counts]))]
    force = np.empty(times.shape)
    for row, (instants, true) in enumerate(zip(dataset.grid()[0][rows], dataset.force[rows], strict=True)):
        for phase in phases:
            force[row, phase] = PchipInterpolator(instants[phase], true[phase])(times[row, phase])
    return force


def printed(table: dict[str, dict[str, float]]) -> str:
    """The errors of a place as text."""
    return "\n".join(
        f"  {name:24}" + "".join(f"  {key} {value:.3f}" for key, value in row.items()) for name, row in table.items()
    )


def main() -> None:
    """Calibrate or judge the model that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder of the model")
    for name, text in (
        ("fit", "data sets to which the expected errors are fitted"),
        ("calibrate", "data sets at accuracy 1e-3"),
        ("judge", "data sets at accuracy 1e-3, one for each place"),
    ):
        parser.add_argument(f"--{name}", type=Path, nargs="+", default=[], help=text)
    chosen = parser.parse_args()
    if bool(chosen.fit) != bool(chosen.calibrate):
        parser.error("--fit and --calibrate must be given together")
    if chosen.calibrate:
        calibrate(chosen.folder, chosen.fit, chosen.calibrate)
    if not chosen.judge:
        return
    model = SolidSurrogate.load(chosen.folder)
    places = {path.stem: judged(model, path) for path in chosen.judge}
    for name, table in places.items():
        print(f"{name}\n{printed(table)}")
    result = {"places": places}
    result |= provenance(f"python -m surrogate.training.solid_judgement {shlex.join(sys.argv[1:])}")
    write_whole(chosen.folder / ERRORS, json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
