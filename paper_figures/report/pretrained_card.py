"""The card of a pretrained model, `fast` or `accurate`; `paper_figures.report.cards` writes it."""

import json
from pathlib import Path
from typing import Any

from paper_figures.report.croissant import LICENCE
from paper_figures.style.writing import number


def error_rows(regions: dict[str, Any]) -> list[str]:
    """Rows of the table of errors by region, as Markdown, from a measurement of `experiments pretrained_errors`."""
    return [
        f"| {words} | {errors['count']} | "
        + " | ".join(
            " / ".join(number(errors[name][share], 2) for share in ("p50", "p90", "p99"))
            for name in ("pull_off", "hysteresis")
        )
        + f" | {errors['covered']:.2f} |"
        for words, errors in regions.items()
    ]


def pretrained_card(folder: Path, measured: dict[str, Any]) -> str:
    """The card of one pretrained model, in Markdown.

    Args:
        folder: Of the model, with `run.json` and `scaling.json`.
        measured: What `experiments pretrained_errors` measured.
    """
    run = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    ranges = json.loads((folder / "scaling.json").read_text(encoding="utf-8"))["ranges"]
    errors = measured["models"][folder.name]
    regions = errors["any"]["regions"]
    regions["corners of the ranges, modulus ratio 0.1"] = errors["corners"]["regions"]["all"]
    units = " and ".join(str(size) for size in run["units"])
    recipe = run["recipe"]
    newline = chr(10)
    return f"""\
# {folder.name}

A network that predicts the force history of a rigid sphere on a soft adhesive viscoelastic half-space, for any standard
linear solid, with an interval for the pull-off force and a band for the force. It imitates the contact solver `bem`.
`make cards` writes this file.

- **Architecture**: LSTMs of {units} units and the readout of the paper's models, {run["parameters"]:,} parameters,
  inputs {run["features"]}, on physical measurement steps (`docs/dataset.md`).
- **Trained on**: {run["training_trajectories"]:,} simulated trajectories, which are not published; `make pretrained`
  makes them again. {run["calibration_trajectories"]:,} more calibrate intervals and bands.
- **Recipe**: {recipe["optimizer"].upper()}, seed {run["seed"]}, {recipe["epochs"]} epochs; weights of epoch
  {run["best_epoch"]}.
- **Command**: `{run["command"]}`
- **Use**: `surrogate predict {folder.name}`, or `surrogate.load("{folder.name}")` from Python.
- **Licence**: {LICENCE}, as the software.

## Errors on hidden protocols

{measured["count"]:,} protocols of any modulus ratio that the training did not see, against the solver's own pull-off
force and hysteresis, in percent: median / 90th / 99th percentile. "Covered" is the share of pull-off forces inside the
{100 * measured["coverage"]:.0f} % interval.

| Region | Protocols | Pull-off force (%) | Hysteresis (%) | Covered |
| --- | --- | --- | --- | --- |
{newline.join(error_rows(regions))}

## Range

| Quantity | Trained for |
| --- | --- |
{newline.join(f"| {name} | {low:g} to {high:g} |" for name, (low, high) in ranges.items())}

Units: h0, retardation times, and h0 per retardation time. Outside, a prediction says so, and its interval is infinite.

## Not for

- Solids with more than one retardation time, plastic or anisotropic ones, and other shapes than a sphere.
- Histories that are not a ramp, a dwell and a ramp back to the start.
- Gradients of the pull-off force where the solver can give them: see `docs/surrogate-models.md`.
- Decisions that the 99th percentiles above would change: use `bem`.
"""
