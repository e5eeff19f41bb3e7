"""What `surrogate predict` was asked and found: protocols, trajectories, and their errors against the solver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np

USUAL_MODULUS_RATIO = 0.1
"""Modulus ratio of the published data set, where neither a model nor the user says another."""


@dataclass
class Answer:
    """One prediction, and what the solver says once it is asked.

    Args:
        scene: The scene that the solver is asked about.
        protocol: The protocol likewise.
        found: Trajectory at measurement steps.
        written: What is written: the same, or the prediction at the points of a given history.
        simulated: The solver's trajectory.
        check: Errors against it, and the materials of both.
        solver_force: Its force where written.
    """

    scene: Any
    protocol: Any
    found: Any
    written: Any
    simulated: Any = None
    check: dict[str, Any] | None = None
    solver_force: np.ndarray | None = None

    def compare(self, model_ratio: float | None) -> None:
        """Ask the solver; `model_ratio` is the model's only modulus ratio, `None` if it knows many, or says none."""
        from bem import simulate
        from surrogate.cli.comparison import solver_errors, solver_force

        self.simulated = simulate(self.scene, self.protocol)
        own = model_ratio if self.found.modulus_ratio is None else self.found.modulus_ratio
        ratios = {"modulus_ratio": self.scene.material.modulus_ratio, "model_modulus_ratio": own}
        self.check = solver_errors(self.found, self.simulated) | ratios
        self.solver_force = solver_force(self.written.time, self.simulated)


def asked_protocols(table: Any, options: dict[str, float | None]) -> tuple[list[Any], Any]:
    """Return the protocols and their Tabor parameters, from a file or from the options.

    Raises:
        ValueError: both or neither are given, or a protocol is not valid.
    """
    import numpy as np

    from bem.protocol import LoadingProtocol
    from bem.scene import Scene

    given = {key: value for key, value in options.items() if value is not None}
    if table is None:
        if missing := [f"--{key.replace('_', '-')}" for key in options if key not in given]:
            raise ValueError(f"Expected --in FILE, or a complete protocol. Received: no {', '.join(missing)}")
        columns = {key: np.array([value]) for key, value in given.items()}
    elif given:
        both = ", ".join([f"--in {table.path}", *(f"--{key.replace('_', '-')}" for key in given)])
        raise ValueError(f"Expected protocols from --in FILE or from options, not both. Received: {both}")
    else:
        columns = table.columns
    protocols = []
    for number, row in enumerate(zip(*(columns[key] for key in options), strict=True)):
        values = dict(zip(options, map(float, row), strict=True))
        try:
            mu = Scene(values.pop("tabor")).tabor
            protocols.append(LoadingProtocol(**values))
            protocols[-1].history(mu)
        except ValueError as error:
            if table is None:
                raise
            # The sentence ends with what was received.
            raise ValueError(f"{error} {table.where(number)}") from error
    return protocols, columns["tabor"]


def readable(number: int, found: Any, check: dict[str, Any] | None) -> str:
    """Return one trajectory in a few lines: results, band, and errors where the solver was asked."""
    banded = found.pull_off_interval is not None
    interval = ""
    if banded and not found.extrapolated:
        low, high = found.pull_off_interval
        interval = f" ({100 * found.coverage:g} % interval {low:.5g} to {high:.5g})"
    line = (
        f"trajectory {number}: pull-off force {found.pull_off_force:.5g}{interval} at time {found.pull_off_time:.5g}, "
        f"hysteresis {found.hysteresis:.5g}, max compression {found.max_compression:.5g}"
    )
    if found.work() < 0.0:
        line += f", work {found.work():.5g}: the contact gave energy back; not dissipation"
    if found.completed and not found.detached:
        line += ", still attached at the end: the pull-off force is the largest so far"
    if banded:
        line += f", modulus ratio {found.modulus_ratio:g}\n{_band_words(found)}"
    if check is None:
        return line
    from bem.trajectory import is_completed

    if not is_completed(check["solver_status"]):
        return f"{line}\n  against the solver: nothing to compare, it did not finish: {check['solver_status']}"
    other = check["model_modulus_ratio"] not in (None, check["modulus_ratio"])
    material = f" of another material (modulus ratio {check['modulus_ratio']:g})" if other else ""
    return (
        f"{line}\n  against the solver{material}: pull-off force off by {check['pull_off_percent']:.2f} % "
        f"({check['pull_off_on_steps_percent']:.2f} % on the measurement steps), hysteresis by "
        f"{check['hysteresis_percent']:.2f} % ({check['hysteresis_on_steps_percent']:.2f} %), "
        f"force by {100 * check['force_rms']:.2f} % of its range (rms)"
    )


def _band_words(found: Any) -> str:
    """Return the band of the force in a few words, for a trajectory that has one."""
    if found.extrapolated:
        return f"  no band: outside the ranges that {found.model} was trained on"
    half = sorted(0.5 * (found.force_upper - found.force_lower))
    return (
        f"  {100 * found.coverage:g} % band of the force at each step: half-width {half[len(half) // 2]:.3g} in the "
        f"median, {half[-1]:.3g} at most; --out and --json give it"
    )
