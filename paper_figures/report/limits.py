"""Numbers of `docs/limits.md` that are published measurements; other rows of the page name a command or a test."""

from typing import Any

from bem.problem.accuracy import resolve_accuracy
from paper_figures.style.writing import number
from paper_figures.tables.table_accuracy_cost import seconds_of
from surrogate.files import PRETRAINED


def hard_cases_text(hard_case_map: Any) -> str:
    """How many random cases in and beyond the paper's box change by more than the target when refined."""
    target = resolve_accuracy(hard_case_map["accuracy"]).target
    changes = {
        where: [row["change"] for row in hard_case_map["map"] if row["where"] == where]
        for where in ("inside", "beyond")
    }
    missed = {where: sum(change > target for change in group) for where, group in changes.items()}
    beyond = changes["beyond"]
    return (
        f"{missed['beyond'] or 'none'} of {len(beyond)} random cases far beyond it at `{hard_case_map['accuracy']}` "
        f"({100.0 * target:g} %) change by more than the target when refined, at most by {100.0 * max(beyond):.1f} %; "
        f"{missed['inside'] or 'none'} of {len(changes['inside'])} inside"
    )


def draft_text(accuracy_cost: Any) -> str:
    """The errors of the pull-off force at draft accuracy."""
    errors = next(tool for tool in accuracy_cost["tools"] if tool["setting"] == "draft")["errors"]["pull_off_force"]
    worst, usual = (number(100.0 * errors[name], 2) for name in ("largest", "p95"))
    return f"by {usual} % (95th percentile) and by at most {worst} % on {accuracy_cost['protocols']} held-out protocols"


def pretrained_text(accuracy_cost: Any) -> str:
    """What one call costs."""
    solver, fast = (seconds_of(accuracy_cost, name) for name in ("solver", "fast"))
    return (
        f"`fast` is {solver['batch'] / fast['batch']:.0f} times cheaper than the solver at standard accuracy, "
        f"{1e3 * fast['batch']:.2g} ms in a batch, and a single call takes {1e3 * fast['single']:.2g} ms (aims: 0.02 "
        "and 0.1 ms)"
    )


def gradients_text(gradients: Any) -> str:
    """Errors of the gradients, and those of the solver's own differences."""
    errors = gradients["gradients"]["errors"]
    texts = (f"`{name}` {number(errors[name]['p50'], 2)} and {number(errors[name]['p90'], 2)} %" for name in PRETRAINED)
    own = errors["solver"]
    return f"{', '.join(texts)} (the solver at standard accuracy {number(own['p50'], 2)} and {number(own['p90'], 2)} %)"
