"""The card of a pretrained model, `fast` or `accurate`; `paper_figures.report.cards` writes it."""

import json
from pathlib import Path
from typing import Any

from paper_figures.report.croissant import LICENCE
from paper_figures.style.writing import number

INSIDE = ("pull_off", "pull_off_time", "hysteresis", "force", "curve")


def error_rows(places: dict[str, Any]) -> list[str]:
    """Rows of the table of errors by place, as Markdown, from a measurement of `experiments errors_by_place`."""
    worst = max(places["corners"], key=lambda one: one["pull_off"][1])
    several = {"all": places["box"], **places["edges"], "the corner that errs most": worst}
    rows = []
    for words, one in several.items():
        errors = [" / ".join(number(level, 2) for level in one[name]) for name in ("pull_off", "hysteresis")]
        covered = [f"{one[f'inside/{name}']:.2f}" for name in INSIDE]
        width = number(one["width/pull_off"][0], 2)
        rows.append(f"| {' | '.join([words, str(one['count']), *errors, *covered, width])} |")
    return rows


def lowest(places: dict[str, Any]) -> str:
    """Smallest coverages in the corners, in words."""
    return ", ".join(f"{min(one[f'inside/{name}'] for one in places['corners']):.2f}" for name in INSIDE)


def pretrained_card(folder: Path, measured: dict[str, Any]) -> str:
    """The card of one pretrained model, in Markdown.

    Args:
        folder: Of the model, with `run.json` and `scaling.json`.
        measured: What `experiments errors_by_place` measured.
    """
    run = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    ranges = json.loads((folder / "scaling.json").read_text(encoding="utf-8"))["ranges"]
    places = measured["models"][folder.name]
    units = " and ".join(str(size) for size in run["units"])
    recipe = run["recipe"]
    newline = chr(10)
    return f"""\
# {folder.name}

A network that predicts the force history of a rigid sphere on a soft adhesive viscoelastic half-space, for any standard
linear solid, with intervals for its results and bands for the force. It imitates the contact solver `bem`.
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

{measured["count"]:,} protocols of any modulus ratio that the training did not see, and {measured["corner"]:,} in each
of {len(places["corners"])} corners of the ranges, against the solver. Errors of the pull-off force are relative to it,
those of the hysteresis to the loop area or, if more, a hundredth of the work of loading; in percent: median / 90th /
99.9th percentile. An edge is the outermost fifth of a range in its logarithm. Then the shares inside the
{100 * measured["coverage"]:.0f} % intervals of pull-off force, its time and hysteresis, inside the band of each step,
and of whole curves inside theirs, and the median width of the interval of the pull-off force in percent.
Measured by `{measured["command"]}`.

| Place | Protocols | Pull-off (%) | Hysteresis (%) | Force in | Time in | Loop in | Step in | Curve in | Width (%) |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
{newline.join(error_rows(places))}

The lowest shares in any corner are, in the same order, {lowest(places)}.

## Range

| Quantity | Trained for |
| --- | --- |
{newline.join(f"| {name} | {low:g} to {high:g} |" for name, (low, high) in ranges.items())}

Units: h0, retardation times, and h0 per retardation time. Outside, a prediction says so, and its interval is infinite.

## Not for

- Solids with more than one retardation time, plastic or anisotropic ones, and other shapes than a sphere.
- Histories that are not a ramp, a dwell and a ramp back to the start.
- Gradients of the pull-off force where the solver can give them: see `docs/surrogate-models.md`.
- Decisions that the 99.9th percentiles above would change: use `bem`.
"""
