"""The six example trajectories of figure 2, and the one that shows the mapping to measurement steps.

Protocols (a) to (f) are the paper's, with the digits that it prints. The paper does not state which trajectory its
mapping figure shows. The one used here has three phases of similar length, so that all of them are visible on one time
axis, and the contact is lost before its end. It is computed at the accuracy of the data set.
"""

from typing import Any

from bem.dataset.records import RESULTS
from experiments.cases import Case, native
from experiments.common import MODULUS_RATIO
from experiments.paper_numbers import paper_rows

MAPPING = {"tabor": 1.0, "peak_indentation": 8.0, "loading_rate": 10.0, "dwell_time": 1.0, "unloading_rate": 10.0}
ACCURACY = "reference"


def example(name: str, quantities: dict[str, float], accuracy: str | float = ACCURACY) -> dict[str, Any]:
    """One trajectory, ready for JSON: its protocol, time steps of the solver, measurement steps and results."""
    case = Case.of(quantities)
    trajectory = case.simulated(accuracy)
    return {
        "name": name,
        "protocol": quantities,
        "phase_times": case.protocol.phase_times(case.scene.tabor),
        "native": native(trajectory),
        "steps": case.on_steps(trajectory),
        "results": {quantity: getattr(trajectory, quantity) for quantity in RESULTS},
        "jumps": len(trajectory.jumps),
    }


def study() -> dict[str, Any]:
    """Simulate the examples."""
    protocols = {row.pop("panel"): row for row in paper_rows("figure_2_protocols")}
    return {
        "accuracy": ACCURACY,
        "modulus_ratio": MODULUS_RATIO,
        "examples": [example(name, protocol) for name, protocol in protocols.items()],
        "mapping": example("mapping", MAPPING, "standard"),
    }
