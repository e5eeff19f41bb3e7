"""Units of the solver's quantities, as text for tables and files."""

TIME, LENGTH, FORCE = "retardation time", "h0", "pi R dgamma"
UNITS = {
    "tabor": "",
    "time": TIME,
    "dwell_time": TIME,
    "pull_off_time": TIME,
    "indentation": LENGTH,
    "stage": LENGTH,
    "peak_indentation": LENGTH,
    "loading_rate": f"{LENGTH} / {TIME}",
    "unloading_rate": f"{LENGTH} / {TIME}",
    "force": FORCE,
    "force_before": FORCE,
    "force_after": FORCE,
    "pull_off_force": FORCE,
    "max_compression": FORCE,
    "end_force": FORCE,
    "hysteresis": f"{LENGTH} {FORCE}",
    "contact_radius": "beta",
    "solver_seconds": "s",
}
"""The unit of each quantity; "" is a pure number."""
