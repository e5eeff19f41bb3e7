"""Table: crack velocities and amplifications of the fourteen protocols of the relaxed short-range limit."""

from typing import Any

from paper_figures.style.writing import Table, caption, number

COLUMNS = {
    "unloading_rate": r"$\hat v_U$",
    "crack_velocity": r"$\tilde v_c$, paper",
    "own_crack_velocity": r"$\tilde v_c$, solver",
    "theory": "theory at the paper's",
    "theory_at_own_velocity": "theory at the solver's",
    "solver": "solver",
    "surrogate": "surrogate",
}


def compose(persson_brener: Any) -> Table:
    """Write the table."""
    summary = persson_brener["summary"]
    deviations = ", ".join(
        f"{text} {summary[f'{name}_median_percent']:.1f} % and {summary[f'{name}_largest_percent']:.1f} %"
        for name, text in (
            ("solver_against_theory", "solver"),
            ("solver_against_theory_at_own_velocity", "solver at its own velocity"),
            ("surrogate_against_theory", "surrogate"),
        )
    )
    first = persson_brener["points"][0]["protocol"]
    note = caption("persson-brener", first=first, found=summary, deviations=deviations)
    # The speed at pull-off is a slope of few steps: its third digit depends on the processor.
    digits = {"own_crack_velocity": 2}
    rows = [
        [str(point["point"]), *(number(point[name], digits.get(name, 3)) for name in COLUMNS)]
        for point in persson_brener["points"]
    ]
    return Table(["Point", *COLUMNS.values()], rows, note)
