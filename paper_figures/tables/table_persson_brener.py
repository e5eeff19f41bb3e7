"""Table: crack velocities and amplifications of the fourteen protocols of the relaxed short-range limit."""

from typing import Any

from paper_figures.style.writing import Table, number

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
    found = persson_brener["summary"]
    deviations = ", ".join(
        f"{text} {found[f'{name}_median_percent']:.1f} % and {found[f'{name}_largest_percent']:.1f} %"
        for name, text in (
            ("solver_against_theory", "solver"),
            ("solver_against_theory_at_own_velocity", "solver at its own velocity"),
            ("surrogate_against_theory", "surrogate"),
        )
    )
    first = persson_brener["points"][0]["protocol"]
    caption = (
        r"Effective surface energy $\hat\Gamma_\mathrm{eff}=|\hat P_\mathrm{po}|/1.5$ at "
        rf"$\mu={first['tabor']:g}$, $\hat\delta_l={first['peak_indentation']:g}$, "
        rf"$\hat v_L={first['loading_rate']:g}$, $\hat t_D={first['dwell_time']:g}$. "
        "The solver's own crack velocity is the speed of the contact edge at pull-off. "
        rf"The surrogate extrapolates: it was trained up to $\mu={found['trained_up_to_tabor']:g}$, and the protocols "
        f"lie {found['extrapolation_percent']:.3g} % beyond. "
        f"Median and largest deviation from Persson-Brener theory: {deviations}."
    )
    rows = [[str(one["point"]), *(number(one[name]) for name in COLUMNS)] for one in persson_brener["points"]]
    return Table(["Point", *COLUMNS.values()], rows, caption)
