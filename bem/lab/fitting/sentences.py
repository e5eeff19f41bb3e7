"""What a fit says in words: what the curve leaves open, what trades off, and which assumptions it contradicts."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from bem.lab.fitting.regression import Fitted
from bem.lab.units import readable

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
    if not best.adequate:
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
    if not best.converged:
        found.append("The search did not converge: its evaluations were spent before the residuals stopped falling.")
    found += [
        f"The curve does not tell {best.model.name} from {other.model.name}: each interval is the union of both."
        for other in alike
    ]
    for name in best.at_bound:
        end = readable(best.values[name], best.problem.parameters[name].unit)
        found.append(f"The best {name} is {'zero' if best.values[name] < 1e-9 else f'at the end of its range, {end}'}.")
    found += [f"The curve does not determine {name}: {best.problem.parameters[name].advice} would." for name in loose]
    found += [
        f"The curve hardly tells {one} from {two} (correlation {correlations[one][two]:.3f}): a measured value of one "
        "would sharpen the other."
        for one, two in itertools.combinations(best.names, 2)
        if abs(correlations[one][two]) > _TIED
    ]
    return (*found, *_contradicted(best))


def _contradicted(best: Fitted) -> list[str]:
    """Assumptions of the model that the fitted values contradict."""
    setup = best.model.setup_of(best.values, best.problem.data.path.setup)
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
    if name == "solver" and setup.range_is_effective and "retardation_time" in best.problem.free:
        found.append(
            f"The retardation time belongs to the effective range, {readable(setup.gap, 'm')}: the edge of the "
            "contact dissipates over it, and a shorter one gives another time."
        )
    return found
