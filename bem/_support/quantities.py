"""Units of the solver's quantities, as text for tables and files."""

TIME, LENGTH, FORCE = "retardation time", "h0", "pi R dgamma"
UNITS = {
    "tabor": "",
    **dict.fromkeys(("time", "dwell_time", "pull_off_time"), TIME),
    **dict.fromkeys(("indentation", "stage", "peak_indentation"), LENGTH),
    **dict.fromkeys(("loading_rate", "unloading_rate"), f"{LENGTH} / {TIME}"),
    **dict.fromkeys(("force", "force_before", "force_after", "pull_off_force", "max_compression", "end_force"), FORCE),
    "hysteresis": f"{LENGTH} {FORCE}",
    "contact_radius": "beta",
    "solver_seconds": "s",
}
"""The unit of each quantity; "" is a pure number."""
