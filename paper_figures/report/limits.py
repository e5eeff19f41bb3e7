"""Numbers of `docs/limits.md` that are published measurements; other rows of the page name a command or a test."""

from typing import Any

from bem.problem.accuracy import resolve_accuracy
from paper_figures.style.writing import number
from paper_figures.tables.table_accuracy_cost import seconds_of


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
        f"`fast` is {solver['batch'] / fast['batch']:.0f} times cheaper than the solver at standard accuracy, and a "
        f"single call takes {1e3 * fast['single']:.2g} ms (aims: 100 times, 0.1 ms)"
    )


def gradients_text(ways_to_call: Any) -> str:
    """Errors of the gradients, and those of the solver's own differences."""
    errors = ways_to_call["gradients"]["errors"]
    texts = (
        f"`{name}` {number(errors[name]['p50'], 2)} and {number(errors[name]['p90'], 2)} %"
        for name in ("fast", "accurate")
    )
    own = errors["solver"]
    return f"{', '.join(texts)} (the solver at standard accuracy {number(own['p50'], 2)} and {number(own['p90'], 2)} %)"


def steps_text(pull_off_place: Any) -> str:
    """What interpolating the exact force between the measurement steps of the pretrained models costs the pull-off."""
    box, corners = pull_off_place["box"], pull_off_place["corners"]
    return (
        f"by {number(box['p99'], 2)} % over the ranges (99th percentile; the aim was 0.05 %), and by "
        f"{number(corners['worst_p90'], 2)} % in the worst corner (90th; 0.15 %)"
    )


def vertices_text(errors_by_place: Any) -> str:
    """Coverage and errors at the vertices of the ranges."""
    corners = {name: model["vertices"] for name, model in errors_by_place["models"].items()}
    held = " and ".join(f"{corners[name]['inside/pull_off']:.2f} (`{name}`)" for name in ("accurate", "fast"))
    errors = ", ".join(f"{number(corner['pull_off'][1], 2)} % ({name})" for name, corner in corners.items())
    return (
        f"at the 32 vertices, modulus ratio 0.1, the 90 % interval of the pull-off force contains the solver's value "
        f"in {held} of the cases; the errors at the 90th percentile are {errors}"
    )
