"""The six example trajectories of the data set figure and the one that shows the mapping to measurement steps.

Protocols (a) to (f) are the paper's, with the digits it prints. The paper does not say which trajectory its mapping
figure shows; ours has three phases of similar length, so that all of them can be seen on one time axis, and is computed
at the accuracy of the data set.
"""

from typing import Any

from bem.dataset.measurement_steps import measurement_grid
from bem.protocol import LoadingProtocol
from experiments.common import paper_protocols

MAPPING = {"tabor": 3.2, "peak_indentation": 12.0, "loading_rate": 5.0, "dwell_time": 2.0, "unloading_rate": 5.0}
MODULUS_RATIO = 0.1
ACCURACY = "reference"


def example(name: str, quantities: dict[str, float], accuracy: str | float = ACCURACY) -> dict[str, Any]:
    """One trajectory: protocol, native history, measurement steps and results, ready for JSON."""
    from bem import Scene, StandardLinearSolid, simulate

    rest = dict(quantities)
    tabor = rest.pop("tabor")
    protocol = LoadingProtocol(**rest)
    trajectory = simulate(Scene(tabor, StandardLinearSolid(MODULUS_RATIO)), protocol, accuracy)
    if not trajectory.completed:
        raise RuntimeError(f"example {name} did not complete: {trajectory.status}")
    times, indentations = measurement_grid(**quantities)
    results = ("pull_off_force", "pull_off_time", "hysteresis", "max_compression", "end_force")
    return {
        "name": name,
        "protocol": quantities,
        "phase_times": protocol.phase_times(tabor),
        "native": {part: getattr(trajectory, part).tolist() for part in ("time", "indentation", "force")},
        "steps": {
            "time": times[0].tolist(),
            "indentation": indentations[0].tolist(),
            "force": trajectory.at(times[0].clip(max=trajectory.time[-1])).tolist(),
        },
        "results": {part: getattr(trajectory, part) for part in results},
        "jumps": len(trajectory.jumps),
    }


def study() -> dict[str, Any]:
    """Simulate the examples."""
    protocols = {row.pop("panel"): row for row in paper_protocols("figure_2_protocols")}
    return {
        "accuracy": ACCURACY,
        "modulus_ratio": MODULUS_RATIO,
        "examples": [example(name, protocol) for name, protocol in protocols.items()],
        "mapping": example("mapping", MAPPING, "standard"),
    }
