"""Latencies: the ticks of a control loop with `bem.Contact`, each a thousandth of a retardation time.

Each random protocol of the paper's box is followed from its start, or, where it is long, in `LONGEST` ticks from a
random instant that one step reaches. The mesh has room for the peak from the start. Times are processor seconds.
`make docs-numbers` writes them into the guide.
"""

from typing import Any

import numpy as np

from bem import Contact
from experiments.measurements.cases import Case, drawn, rows_of
from experiments.measurements.harness import CLOCK, Count, Seed, progress

TICK, LONGEST = 1e-3, 3000
LEVELS = (50.0, 99.0, 99.9)


def ticks(case: Case, generator: np.random.Generator) -> list[float]:
    """Processor seconds of the ticks of one protocol."""
    history, end = case.protocol.history(case.scene.tabor), 0.0
    contact = Contact(case.scene, deepest=case.protocol.peak_indentation)
    count = int(history.times[-1] / TICK)
    if count > LONGEST:
        end = TICK * int(generator.integers(1, count - LONGEST + 1))
        contact.advance(end, indentation=float(history.indentation_at(end)))
    spent = []
    for number in range(1, min(count, LONGEST) + 1):
        depth = float(history.indentation_at(end + number * TICK))
        with CLOCK:
            contact.advance(TICK, indentation=depth)
        spent.append(CLOCK.seconds)
    return spent


def ticks_text(contact_ticks: Any) -> str:
    """The measurement as a sentence, for docs/simulate.md."""
    each = {name: 1e3 * value for name, value in contact_ticks["seconds"].items()}
    return (
        f"A step of {TICK:g} retardation times takes {each['50']:.2f} ms (median; 99th percentile {each['99']:.2f} ms, "
        f"99.9th {each['99.9']:.2f} ms) in {contact_ticks['count']:,} steps over the paper's box; "
        f"{100.0 * contact_ticks['below_a_millisecond']:.2f} % take less than 1 ms. Measured on one core of "
        f"{contact_ticks['host']}."
    )


def study_contact_ticks(*, count: Count = 40, seed: Seed = 5) -> dict[str, Any]:
    """How long a tick of 1 ms of `bem.Contact` takes, over random protocols."""
    generator = np.random.default_rng(seed)
    cases = [Case.of(row) for row in rows_of(drawn("inside", count, seed))]
    spent = np.concatenate([ticks(case, generator) for case in progress(cases, "protocols")])
    found = {f"{level:g}": float(np.percentile(spent, level)) for level in LEVELS}
    below = float(np.mean(spent < 1e-3))
    return {"count": spent.size, "seconds": found, "largest": float(spent.max()), "below_a_millisecond": below}
