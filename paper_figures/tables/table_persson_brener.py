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
    "paper": "surrogate, paper's recipe",
    "swift": "surrogate, swift",
}


def compose(persson_brener: Any) -> Table:
    """Write the table."""
    summary = persson_brener["summary"]
    columns = {name: head for name, head in COLUMNS.items() if name in persson_brener["points"][0]}
    deviations = ", ".join(
        f"{text} {summary[f'{name}_median_percent']:.1f} % and {summary[f'{name}_largest_percent']:.1f} %"
        for name, text in (
            ("solver_against_theory", "solver"),
            ("solver_against_theory_at_own_velocity", "solver at its own velocity"),
            *((f"{name}_against_theory", columns[name]) for name in ("paper", "swift") if name in columns),
        )
    )
    first = persson_brener["points"][0]["protocol"]
    note = caption("persson-brener", first=first, found=summary, deviations=deviations)
    # The speed at pull-off is a slope of few steps: its third digit depends on the processor.
    digits = {"own_crack_velocity": 2}
    rows = [
        [str(point["point"]), *(number(point[name], digits.get(name, 3)) for name in columns)]
        for point in persson_brener["points"]
    ]
    return Table(["Point", *columns.values()], rows, note)
