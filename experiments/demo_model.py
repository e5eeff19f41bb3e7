"""The pretrained model as the browser demonstrator evaluates it: one file of numbers, `demo/public/fast.bin`.

The file is one line of JSON, filled with spaces to a multiple of eight bytes, then float64 and then float32, both
little-endian. The line holds counts of points, the ranges that the page offers, and name and shape of each array in its
order. The arrays are those of the model's folder: both stages, what their training covers, and the intervals, of which
only the quantiles at `COVERAGE` for the kinds of solids that the page has. `demo/src/fast.ts` reads it.

Usage: `python -m experiments.demo_model`.
"""

if __name__ == "__main__":  # before the imports that take long
    from bem._support.interruption import end_on_interrupt

    end_on_interrupt("experiments.demo_model")

import json
from pathlib import Path

import numpy as np

import surrogate
from bem._support.command_line import run_main
from bem._support.outputs import write_whole
from experiments.cases import RANGES
from surrogate.intervals import KINDS, LEVELS
from surrogate.model import Surrogate
from surrogate.solids import SolidSurrogate

NAME = "fast"
OUT = Path("demo/public/fast.bin")
COVERAGE = 0.9
SOLIDS = ("few times close together", "elastic")
"""Of the kinds of solids in `surrogate.intervals`: a standard linear solid, and one of modulus ratio 1."""
TYPES = {"doubles": "<f8", "singles": "<f4"}
"""Types of the arrays, by the name of their list."""


def packed(model: Surrogate | SolidSurrogate) -> bytes:
    """Return the file of a model.

    Raises:
        ValueError: it is none of any linear solid, or has no intervals.
    """
    if not isinstance(model, SolidSurrogate) or model.intervals is None:
        raise ValueError(f"model must be one of any linear solid with intervals; received {model.name}")
    arrays = model.stages[0].as_arrays("scalars") | model.stages[1].as_arrays("curve")
    intervals = model.intervals.as_arrays()
    intervals["quantiles"] = intervals["quantiles"][[*map(KINDS.index, SOLIDS)], :, :, LEVELS.index(COVERAGE)]
    arrays |= {f"reach/{name}": values for name, values in vars(model.reach).items()}
    arrays |= {f"intervals/{name}": values for name, values in intervals.items()}
    doubles = {name: values for name, values in arrays.items() if values.dtype == np.float64}
    lists = {"doubles": doubles, "singles": {name: arrays[name] for name in arrays if name not in doubles}}
    head = {"format": "contact-demo-model", "name": model.name, "counts": model.counts, "ranges": RANGES}
    head |= {key: {name: values.shape for name, values in group.items()} for key, group in lists.items()}
    line = json.dumps(head).encode()
    line += b" " * (-(len(line) + 1) % 8) + b"\n"
    numbers = [values.astype(TYPES[key]).tobytes() for key, group in lists.items() for values in group.values()]
    return line + b"".join(numbers)


def main() -> None:
    """Write the file."""
    OUT.parent.mkdir(parents=True, exist_ok=True)
    write_whole(OUT, packed(surrogate.load(NAME)))
    print(f"{OUT}: {OUT.stat().st_size} bytes")


if __name__ == "__main__":
    run_main(main)
