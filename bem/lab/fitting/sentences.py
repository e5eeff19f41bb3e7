"""What a fit says in words: what the curve leaves open, what trades off, and which assumptions it contradicts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bem.lab.fitting.regression import Fitted
from bem.lab.setup import Setup
from bem.lab.units import readable

ADEQUATE = 1.5
"""Misfit up to which a model describes a curve."""
_LOOSE = {"logarithm": np.log(2.0), "logit": 2.0}
_TIED = 0.98  # correlation from which two parameters are said to trade off


def is_loose(best: Fitted, name: str, interval: tuple[float, float]) -> bool:
    """Whether a curve leaves a parameter open: by a factor of two, or by the whole depth; whatever its unit."""
    if name not in best.problem.free or name in best.at_bound:
        return name in best.at_bound and name != "work_of_adhesion"
    parameter = best.problem.parameters[name]
    if parameter.scale != "linear":
        low, high = (parameter.inner(bound) if 0.0 < bound < np.inf else np.inf for bound in interval)
        return not high - low < 2.0 * _LOOSE[parameter.scale]
    if name == "contact_point":
        return not interval[1] - interval[0] < float(np.ptp(best.problem.data.depth))
    return bool(interval[0] <= parameter.low)


def sentences_of(
    best: Fitted,
    correlations: dict[str, dict[str, float]],
    loose: Sequence[str],
    alike: Sequence[Fitted],
    windows: Sequence[float],
) -> tuple[str, ...]:
    """The sentences of a fit, in the order of their weight.

    Args:
        best: the model chosen.
        correlations: between its parameters.
        loose: parameters that the curve leaves open.
        alike: models that the curve does not tell from it.
        windows: moduli over windows of depth, where no model is adequate.
    """
    found = []
    if best.misfit > ADEQUATE:
        found.append(
            f"No model is adequate: the residuals of the best are {best.misfit:.1f} times the noise of the "
            "measurement, so that no interval holds."
        )
        if windows:
            found.append(
                f"By Hertz on the approach the modulus runs from {readable(min(windows), 'Pa')} to "
                f"{readable(max(windows), 'Pa')} over windows of depth."
            )
    elif best.beyond_chance:
        found.append(
            f"The residuals are {best.misfit:.2f} times the noise of the baseline, more than chance allows: the model "
            "misses something, or another minimum is better, and the intervals may be too narrow."
        )
    for other in alike:
        found.append(
            f"The curve does not tell {best.model.name} from {other.model.name}: each interval is the union of both."
        )
    for name in best.at_bound:
        value = best.values[name]
        at = (
            "zero"
            if value < 1e-9
            else f"at the end of its range, {readable(value, best.problem.parameters[name].unit)}"
        )
        found.append(f"The best {name} is {at}.")
    found += [f"The curve does not determine {name}: {best.problem.parameters[name].advice} would." for name in loose]
    names = best.names
    for i, one in enumerate(names):
        for other_name in names[i + 1 :]:
            if abs(correlations[one][other_name]) > _TIED:
                found.append(
                    f"The curve hardly tells {one} from {other_name} (correlation "
                    f"{correlations[one][other_name]:.3f}): a measured value of one would sharpen the other."
                )
    setup = best.model.setup_of(best.values, best.problem.data.path.setup)
    found += _contradicted(best, setup)
    return tuple(found)


def _contradicted(best: Fitted, setup: Setup) -> list[str]:
    """Assumptions of the model that the fitted values contradict."""
    depth, name, found = float(best.problem.data.depth.max()), best.model.name, []
    if setup.half_angle is None and depth > 0.5 * setup.radius:
        found.append(
            f"The depth, {readable(depth, 'm')}, is not small beside the radius, {readable(setup.radius, 'm')}."
        )
    if setup.half_angle is not None and depth < 2.0 * setup.radius:
        found.append(f"The depth, {readable(depth, 'm')}, is not large beside the radius of the apex.")
    tabor = setup.physical_tabor
    if name == "dmt" and tabor > 0.3:
        found.append(f"DMT assumes a Tabor parameter below 0.1; the fitted values give {tabor:.3g}.")
    if name == "jkr" and tabor < 2.0:
        found.append(f"JKR assumes a Tabor parameter above 5; the fitted values give {tabor:.3g}.")
    if best.model.name == "solver" and setup.range_is_effective and "retardation_time" in best.problem.free:
        found.append(
            f"The retardation time belongs to the effective range, {readable(setup.gap, 'm')}: the edge of the "
            "contact dissipates over it, and a shorter one gives another time."
        )
    return found
