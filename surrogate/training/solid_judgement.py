r"""Calibrate a model of any linear solid, and judge it, against the converged solver.

    bem campaign --solids prony:1-4 --design sobol --modulus-ratio 0.01:1 --steps pull-off --accuracy 1e-3 \
        --count 6000 --seed 176 --out calibration.h5
    python -m surrogate.training.solid_judgement MODEL --fit fit.h5 --calibrate calibration.h5
    python -m surrogate.training.solid_judgement MODEL --judge test.h5 --out errors.json

The expected errors are fitted to `--fit`, at the accuracy of the training: on the training itself errors are too small,
most where it is sparse. Those trajectories, and those of `--calibrate` and `--judge`, come from seeds that no training
saw. Each file of `--judge` is a place: a kind of solids, a corner, an edge.
"""

from __future__ import annotations

import argparse
import json
import shlex
import sys
import time
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from bem._support.outputs import write_whole
from bem._support.provenance import provenance
from bem.dataset.campaign import Campaign
from bem.dataset.designs import OUTERMOST, QUANTITIES
from bem.dataset.file import Dataset, load_dataset
from bem.problem.materials import Elastic, StandardLinearSolid
from bem.problem.protocol import LoadingProtocol
from bem.problem.scene import Scene
from surrogate.loading import load
from surrogate.model import Surrogate
from surrogate.solid_intervals import SolidIntervals, kinds_of
from surrogate.solids import SCALARS, SolidSurrogate, scalar_targets, write_intervals

COVERAGES = (0.5, 0.9)
QUANTILES = (0.5, 0.9, 0.99)
FITTED = 40_000
"""Trajectories at most to which the expected errors are fitted."""


def compared(
    model: SolidSurrogate, dataset: Dataset, rows: np.ndarray, *, curve: bool = False
) -> dict[str, np.ndarray]:
    """Predictions of some trajectories of a data set, with the `errors` (batch, 4) of their targets.

    Returns:
        What `SolidSurrogate.predict_many` does, and `errors`, `kinds` and the true `SCALARS` as `true_...`.
    """
    protocols = {name: values[rows] for name, values in dataset.protocols.items()}
    strengths, times = (values[rows] for values in dataset.solids)
    prediction = model.predict_many(protocols, strengths, times, curve=curve)
    true = {name: dataset.scalars[name][rows] for name in SCALARS}
    begin = dataset.grid()[0][rows, sum(dataset.counts[:2]) - 1]
    prediction["errors"] = prediction["targets"] - scalar_targets(true, begin, protocols["unloading_rate"])
    prediction["kinds"] = kinds_of(strengths, times)
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
        features, kinds, errors = (
            np.concatenate([part[name] for part in parts]) for name in ("features", "kinds", "errors")
        )
        if intervals is None:
            intervals = SolidIntervals.fit(features, errors)
        else:
            intervals = intervals.calibrated(features, kinds, errors)
    write_intervals(folder, intervals)


def judged(model: SolidSurrogate, path: Path) -> dict[str, dict[str, float]]:
    """Errors in per cent at `QUANTILES`, and coverages in per cent, of a data set.

    They are those of contacts that the model takes without a warning; their share is there too. Those of the
    compression are relative to it, or to a force of 1 where it is less; those of the curve relative to its range, the
    mean and the largest over the instants of unloading and all others. At edges and in corners there are the
    coverages on each of their `sides`, too.
    """
    dataset = load_dataset(path)
    rows = dataset.completed
    part = compared(model, dataset, rows, curve=True)
    inside = np.array([not texts for texts, _ in model.reach.outside(part["features"])])
    rows, part = rows[inside], {name: values[inside] for name, values in part.items()}
    true = {name: part[f"true_{name}"] for name in SCALARS}
    since = [part["pull_off_time"] - part["begin"], true["pull_off_time"] - part["begin"]]
    compression = np.abs(part["max_compression"] - true["max_compression"])
    differences = _curve_differences(part["times"], part["force"], dataset, rows)
    extent = np.ptp(dataset.force[rows], axis=1)
    errors = {
        "pull-off force": np.abs(part["pull_off_force"] / true["pull_off_force"] - 1.0),
        "time since the dwell": np.abs(since[0] / since[1] - 1.0),
        "hysteresis": np.abs(part["hysteresis"] / true["hysteresis"] - 1.0),
        "largest compression": compression / np.maximum(np.abs(true["max_compression"]), 1.0),
        "curve, mean": differences.mean(axis=1) / extent,
        "curve, largest": differences.max(axis=1) / extent,
    }
    table = {
        name: {f"{100 * level:g}": 100.0 * float(np.quantile(values, level)) for level in QUANTILES}
        for name, values in errors.items()
    }
    bias = part["pull_off_force"] / true["pull_off_force"] - 1.0
    table["pull-off force"]["bias"] = 100.0 * float(np.median(bias))
    if model.intervals is not None:
        for coverage in COVERAGES:
            half = model.intervals.half_widths(part["features"], part["kinds"], coverage)
            for column, name in enumerate(list(errors)[:4]):
                covered = np.abs(part["errors"][:, column]) <= half[:, column]
                table[name][f"covered at {coverage:g}"] = 100.0 * float(covered.mean())
                if coverage == COVERAGES[-1] and dataset.attributes["campaign"]["design"] != "sobol":
                    for side, members in sides(dataset, rows).items():
                        share = 100.0 * float(covered[members].mean()) if members.any() else np.nan
                        table.setdefault(f"at {side}", {"count": float(members.sum())})[name] = share
    return table | {"trajectories": {"count": len(inside), "inside": 100.0 * float(inside.mean())}}


def sides(dataset: Dataset, rows: np.ndarray) -> dict[str, np.ndarray]:
    """Which contacts (batch,) lie in the outermost fifth of the range of a quantity, in its logarithm, by its name."""
    campaign, members = dataset.attributes["campaign"], {}
    for name, drawn in (campaign["ranges"] | {"modulus_ratio": campaign["modulus_ratio"]}).items():
        low, high = np.broadcast_to(drawn, 2)
        if low == high:
            continue
        values = dataset.modulus_ratios if name == "modulus_ratio" else dataset.protocols[name]
        share = np.log(values[rows] / low) / np.log(high / low)
        members |= {f"low {name}": share <= OUTERMOST, f"high {name}": share >= 1.0 - OUTERMOST}
    return members


def judged_by_call(model: Surrogate, path: Path) -> dict[str, dict[str, float]]:
    """The same of `fast` or `accurate` on standard linear solids, but for the largest compression."""
    dataset = load_dataset(path)
    rows = dataset.completed
    columns = zip(*(dataset.protocols[name][rows].tolist() for name in QUANTITIES[1:]), strict=True)
    protocols = [LoadingProtocol(**dict(zip(QUANTITIES[1:], row, strict=True))) for row in columns]
    contacts = zip(dataset.protocols["tabor"][rows].tolist(), dataset.modulus_ratios[rows].tolist(), strict=True)
    scenes = [Scene(tabor, StandardLinearSolid(ratio) if ratio < 1.0 else Elastic()) for tabor, ratio in contacts]
    begin = dataset.grid()[0][rows, sum(dataset.counts[:2]) - 1]
    predictions = model.predict(scenes, protocols)
    table = {}
    for label, name, interval, since in (
        ("pull-off force", "pull_off_force", "pull_off_interval", 0.0),
        ("time since the dwell", "pull_off_time", "pull_off_time_interval", begin),
        ("hysteresis", "hysteresis", "hysteresis_interval", 0.0),
    ):
        true = dataset.scalars[name][rows]
        values = np.array([getattr(prediction, name) for prediction in predictions])
        low, high = np.array([getattr(prediction, interval) for prediction in predictions]).T
        errors = np.abs((values - since) / (true - since) - 1.0)
        table[label] = {f"{100 * level:g}": 100.0 * float(np.quantile(errors, level)) for level in QUANTILES}
        table[label]["covered at 0.9"] = 100.0 * float(np.mean((low <= true) & (true <= high)))
    times, force = (np.array([getattr(entry, name) for entry in predictions]) for name in ("time", "force"))
    differences = _curve_differences(times, force, dataset, rows) / np.ptp(dataset.force[rows], axis=1)[:, np.newaxis]
    for label, values in (("mean", differences.mean(axis=1)), ("largest", differences.max(axis=1))):
        table[f"curve, {label}"] = {
            f"{100 * level:g}": 100.0 * float(np.quantile(values, level)) for level in QUANTILES
        }
    return table | {"trajectories": {"count": len(rows), "inside": 100.0}}


def _curve_differences(times: np.ndarray, force: np.ndarray, dataset: Dataset, rows: np.ndarray) -> np.ndarray:
    """Absolute differences of forces at steps (batch, steps) from the true ones, which are interpolated there."""
    ends = np.cumsum([0, *dataset.counts])
    phases = [slice(max(begin - 1, 0), end) for begin, end in pairwise(ends)]
    differences = np.empty(force.shape)
    for row, (instants, true) in enumerate(zip(dataset.grid()[0][rows], dataset.force[rows], strict=True)):
        for phase in phases:
            interpolated = PchipInterpolator(instants[phase], true[phase])(times[row, phase])
            differences[row, phase] = np.abs(force[row, phase] - interpolated)
    return differences


def printed(table: dict[str, dict[str, float]]) -> str:
    """The errors of a place as text."""
    return "\n".join(
        f"  {name:24}" + "".join(f"  {key} {value:.3f}" for key, value in row.items()) for name, row in table.items()
    )


def milliseconds(model: Any, path: Path, *, batch: int = 512, repeats: int = 20) -> dict[str, float]:
    """Least wall time of a call for one contact of a data set, and of one in a batch."""
    dataset = load_dataset(path)
    scenes, protocols = zip(
        *Campaign.of(dataset.attributes["campaign"]).cases_of(dataset.completed[:batch]), strict=True
    )

    def least(calls: int, scene: Any, protocol: Any) -> float:
        times = []
        for _ in range(calls):
            begin = time.perf_counter()
            model.predict(scene, protocol)
            times.append(time.perf_counter() - begin)
        return 1e3 * min(times)

    return {
        "single": least(10 * repeats, scenes[0], protocols[0]),
        "batch": least(repeats, scenes, protocols) / len(scenes),
    }


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
    parser.add_argument(
        "--beside", type=Path, help="folder of `fast`, to judge it where solids are standard linear ones"
    )
    parser.add_argument("--out", type=Path, help="JSON file for what --judge prints")
    chosen = parser.parse_args()
    if bool(chosen.fit) != bool(chosen.calibrate):
        parser.error("--fit and --calibrate must be given together")
    if chosen.calibrate:
        calibrate(chosen.folder, chosen.fit, chosen.calibrate)
    model, result = SolidSurrogate.load(chosen.folder), {"places": {}, "beside": {}}
    for path in chosen.judge:
        result["places"][path.stem] = judged(model, path)
        if chosen.beside is not None and load_dataset(path).solids[0].shape[1] == 1:
            result["beside"][f"{chosen.beside.name}, {path.stem}"] = judged_by_call(load(chosen.beside), path)
    for name, table in (result["places"] | result["beside"]).items():
        print(f"{name}\n{printed(table)}")
    if chosen.out is not None:
        result |= {"milliseconds": milliseconds(model, chosen.judge[0])}
        result |= provenance(f"python -m surrogate.training.solid_judgement {shlex.join(sys.argv[1:])}")
        write_whole(chosen.out, json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
