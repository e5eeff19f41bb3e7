"""Tables: the protocols of figure 2 with their results, and the data set compared with the paper's."""

from typing import Any

from paper_figures.style import drawing
from paper_figures.style.writing import Table, caption, number

QUANTITIES = {
    "loading_rate": r"$\hat v_L$",
    "dwell_time": r"$\hat t_D$",
    "unloading_rate": r"$\hat v_U$",
    "tabor": r"$\mu$",
    "peak_indentation": r"$\hat\delta_l$",
}
"""Symbols of the quantities, as in the paper and in the order of its tables."""
RESULTS = {
    "pull_off_force": r"$\hat P_\mathrm{po}$",
    "pull_off_time": r"$\hat t_\mathrm{po}$",
    "max_compression": r"$\hat P_\mathrm{mc}$",
    "hysteresis": r"$\hat A_\mathrm{hys}$",
    "end_force": r"$\hat P(t_3)$",
}


def summary_rows(summary: dict[str, Any], paper: dict[str, Any]) -> list[list[str]]:
    """One row for each quantity: its name, the paper's value and ours."""
    seconds, floor = summary["solver_seconds"], summary["resolution_floor"]["pull_off_force"]
    ranges = {name: paper["ranges"][name] for name in QUANTITIES}
    mean = 3600.0 * paper["cpu_hours"] / paper["trajectories"]
    unknown, hosts, memory = "not stated", summary["host"], summary["peak_memory"]
    return [
        ["trajectories", str(paper["trajectories"]), str(summary["trajectories"])],
        ["of these completed", unknown, str(summary["completed"])],
        ["distinct protocols", unknown, str(summary["distinct_protocols"])],
        *(
            [symbol, *(" to ".join(map(number, bounds)) for bounds in (ranges[name], summary["ranges"][name]))]
            for name, symbol in QUANTITIES.items()
        ),
        ["solver time in all", f"{paper['cpu_hours']} CPU-hours", f"{seconds['sum'] / 60.0:.2f} CPU-minutes"],
        ["solver time, mean", f"{mean:.0f} s", f"{1e3 * seconds['mean']:.1f} ms"],
        ["solver time, median", unknown, f"{1e3 * seconds['median']:.1f} ms"],
        ["wall time", unknown, f"{summary['wall_seconds'] / 60.0:.2f} minutes"],
        ["workers' time on trajectories over solver time", unknown, f"{summary['trajectories_over_solver']:.3f}"],
        ["whole run over solver time", unknown, f"{summary['run_over_solver']:.3f}"],
        ["parallel efficiency", unknown, f"{summary['parallel_efficiency']:.3f}"],
        ["peak memory", unknown, f"{memory / 1e6:.0f} MB" if memory else "not recorded"],
        ["hardware", paper["hardware"], "; ".join([hosts] if isinstance(hosts, str) else hosts)],
        ["trajectories never compressed", unknown, str(summary["never_compressed"])],
        ["trajectories with a jump", unknown, f"{100 * summary['with_jumps']:.1f} %"],
        ["still attached at the end", unknown, f"{100 * summary['still_attached']:.1f} %"],
        ["end force above half the pull-off force", unknown, f"{100 * summary['end_force_above_half_pull_off']:.1f} %"],
        *(
            [f"resolution floor of the pull-off force, {label}", unknown, f"{100 * floor[name]:.2g} %"]
            for name, label in (("median", "median"), ("p90", "90th percentile"), ("p99", "99th percentile"))
        ),
        ["resolution floor above 20 %", unknown, f"{100 * summary['floor_above_20_percent']:.1f} % of trajectories"],
    ]


def compose(dataset_examples: Any, dataset_statistics: Any) -> dict[str, Table]:
    """Write both tables."""
    rows = [
        [
            f"({example['name']})",
            *(number(example["protocol"][name]) for name in QUANTITIES),
            *(number(example["results"][name], 4) for name in RESULTS),
            str(example["jumps"]),
        ]
        for example in dataset_examples["examples"]
    ]
    first = Table(
        ["Panel", *QUANTITIES.values(), *RESULTS.values(), "Jumps"],
        rows,
        caption("protocols-dataset", accuracy=dataset_examples["accuracy"]),
    )
    second = Table(
        ["Quantity", "Paper", "Here"],
        summary_rows(dataset_statistics, drawing.paper_values("dataset")),
        caption("dataset-summary", accuracy=dataset_statistics["accuracy"], workers=dataset_statistics["workers"]),
    )
    return {"protocols-dataset": first, "dataset-summary": second}
