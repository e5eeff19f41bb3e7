"""What `surrogate predict` was asked and found: protocols, trajectories, and their errors against the solver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np

USUAL_MODULUS_RATIO = 0.1
"""Modulus ratio of the published data set, where neither a model nor the user says another."""


@dataclass(frozen=True)
class Answer:
    """Predictions of one call, one entry per trajectory.

    Args:
        scenes: The scenes that the solver is asked about; of a history, one for a check.
        protocols: The protocols; of a history, only for a check.
        found: Trajectories at measurement steps.
        written: What is written: the same, or at the points of a given history.
        model_ratio: Modulus ratio that the model was trained on; `None` if it knows many, or does not say.
    """

    scenes: Sequence[Any]
    protocols: Sequence[Any]
    found: Sequence[Any]
    written: Sequence[Any]
    model_ratio: float | None

    def compared(self) -> tuple[list[Any], list[dict[str, Any]], list[np.ndarray]]:
        """Return of each the solver's trajectory, errors and both materials, and the solver's force where written."""
        from bem import simulate
        from surrogate.cli.comparison import solver_errors, solver_force

        simulated = [simulate(scene, protocol) for scene, protocol in zip(self.scenes, self.protocols, strict=True)]
        rows = []
        for found, true, scene in zip(self.found, simulated, self.scenes, strict=True):
            ratio = scene.material.modulus_ratio
            own = self.model_ratio if found.modulus_ratio is None else found.modulus_ratio
            rows.append(solver_errors(found, true) | {"modulus_ratio": ratio, "model_modulus_ratio": own})
        forces = [solver_force(written.time, true) for written, true in zip(self.written, simulated, strict=True)]
        return simulated, rows, forces


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
