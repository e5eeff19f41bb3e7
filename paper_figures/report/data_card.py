"""The card of the data set; `paper_figures.report.cards` writes it. Its numbers in README.md."""

from pathlib import Path

import numpy as np

from bem.dataset.file import Dataset, load_dataset
from experiments.paper_numbers import paper_values
from paper_figures.report.croissant import LICENCE, METADATA
from paper_figures.style.writing import number

SHARES = (0.0, 0.1, 0.5, 0.9, 1.0)


def data_card(path: Path, dataset: Dataset) -> str:
    """The card of the data set, in Markdown."""
    about, scalars = dataset.attributes, dataset.scalars
    lines = [f"| {name} | {low:g} to {high:g} |" for name, (low, high) in about["ranges"].items()]
    kinds = {name: scalars[name] for name in ("pull_off_force", "hysteresis", "max_compression", "end_force")}
    quantiles = [
        f"| {name} | " + " | ".join(number(float(np.quantile(values, share)), 3) for share in SHARES) + " |"
        for name, values in kinds.items()
    ]
    attached = np.mean(scalars["end_force"] > 0.5 * scalars["pull_off_force"])
    jumping = np.mean(scalars["jump_count"] > 0)
    minutes = scalars["solver_seconds"].sum() / 60.0
    newline = chr(10)
    return f"""\
# Force histories of soft, adhesive, viscoelastic contacts

`{path.name}`, with metadata in `{METADATA}`. `make cards` writes this file.

## About

{len(dataset):,} force histories of a rigid sphere that is pressed into, held on and pulled off a soft adhesive
viscoelastic half-space; the training data of the models beside it, and those of the paper computed again.

## Physics

Lennard-Jones attraction; a standard linear solid of modulus ratio {about["modulus_ratio"]:g}; a boundary
element method on a half-space (`docs/theory.md`). Each history is a ramp, a dwell and a ramp back to
the start, drawn from the design `{about["design"]}`:

| Quantity | Range |
| --- | --- |
{newline.join(lines)}

Units: h0, retardation times, and h0 per retardation time; forces in pi R dgamma, tension positive.

## Format and size

HDF5, {path.stat().st_size / 1e6:.0f} MB: the force at {dataset.force.shape[1]} measurement steps of each history,
its protocol, scalars and jumps, each array with its unit.
`docs/dataset.md` lists the arrays and reads them with h5py, pandas and xarray.

| Scalar | least | 10 % | median | 90 % | largest |
| --- | --- | --- | --- | --- | --- |
{newline.join(quantiles)}

## Limits

- {100 * jumping:.0f} % of the histories hold a jump. {100 * attached:.0f} % end above half of their pull-off
  force: the sphere is still attached, and the pull-off force is the largest so far.
- The measurement steps can miss a narrow peak; the scalars are those of the solver's own, finer history.
- One material, one shape, no noise: not for a solid of another modulus ratio.

## Generation

`{about["command"]}`,
in {minutes:.2g} core-minutes of the solver on {about["host"]}. Accuracy `{about["accuracy"]}`, seed {about["seed"]},
revision {about["git_revision"]}.

## Licence and citation

{LICENCE}, as the software; the weights of the models have the same licence. Cite as in `CITATION.cff`.
"""


def trajectories(dataset: Path) -> str:
    """Number of trajectories."""
    return f"{len(load_dataset(dataset)):,}"


def core_seconds(dataset: Path) -> str:
    """Seconds of the solver in all."""
    return f"{load_dataset(dataset).scalars['solver_seconds'].sum():.2g}"


def milliseconds(dataset: Path) -> str:
    """Milliseconds of the solver for each trajectory."""
    return f"{1e3 * load_dataset(dataset).scalars['solver_seconds'].mean():.2g}"


def paper_hours() -> str:
    """CPU-hours of the paper's data set."""
    return str(paper_values("dataset")["cpu_hours"])
