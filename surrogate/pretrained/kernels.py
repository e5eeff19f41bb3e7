"""What happens to a batch before and after the network, compiled: it would take longer than the network otherwise."""

from __future__ import annotations

import numpy as np

from bem._numerics.jit import kernel
from bem._numerics.monotone import monotone_integral, monotone_slopes
from surrogate.data.physics import physics_channels


@kernel
def _symlog(value: float) -> float:
    return np.copysign(np.log1p(abs(value)), value)


@kernel
def scaled_inputs(
    times: np.ndarray,
    indentations: np.ndarray,
    tabor: np.ndarray,
    modulus_ratio: np.ndarray,
    counts: np.ndarray,
    mean: np.ndarray,
    scale: np.ndarray,
) -> np.ndarray:
    """Scaled channels F and, last, the scaled Tabor parameter: float32 of shape (steps, batch, 13).

    The same as `surrogate.data.scaling.Scaling.scale_channels` of `surrogate.data.features.channels`, in one pass.

    Args:
        times, indentations: Histories of shape (batch, steps).
        tabor, modulus_ratio: One for each, shape (batch,).
        counts: Points of loading, dwell and unloading.
        mean, scale: Moments of the 12 channels and of the Tabor parameter, each of shape (13,).
    """
    batch, steps = times.shape
    physics = physics_channels(times, indentations, tabor, modulus_ratio)
    found = np.empty((steps, batch, 13), dtype=np.float32)
    channel = np.zeros(13)
    for row in range(batch):
        channel[9], channel[12] = np.log(modulus_ratio[row]), _symlog(tabor[row])
        for step in range(steps):
            velocity, channel[4] = 0.0, 0.0
            if step > 0:
                dt = times[row, step] - times[row, step - 1]
                velocity = (indentations[row, step] - indentations[row, step - 1]) / dt
                channel[4] = np.log(dt)
            channel[0] = _symlog(_symlog(times[row, step]))
            channel[1] = _symlog(indentations[row, step])
            channel[2] = _symlog(velocity)
            channel[3] = 1.0 if step == counts[0] - 1 or step == counts[0] + counts[1] - 1 else 0.0
            for i in range(4):
                channel[5 + i] = _symlog(physics[i, row, step])
            channel[10] = 1.0 if velocity > 0.0 else 0.0
            channel[11] = 1.0 if velocity < 0.0 else 0.0
            for i in range(13):
                found[step, row, i] = (channel[i] - mean[i]) / scale[i]
    return found


@kernel
def results(times: np.ndarray, indentations: np.ndarray, force: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Results of histories (batch, steps): rows pull-off force, its time, its sharpness and the work, each (batch,).

    The pull-off force is the top of the parabola through the highest step of the unloading and its neighbours; the
    sharpness is by how much the higher one of these is less, as a share. The work is the integral of -P d(indentation)
    of monotone cubics, phase by phase.
    """
    found = np.empty((4, len(times)))
    loading, turn = counts[0], counts[0] + counts[1] - 1
    for row in range(len(times)):
        time, values = times[row], force[row]
        top = turn + np.argmax(values[turn:])
        found[0, row], found[1, row] = values[top], time[top]
        if turn < top < len(time) - 1:
            before, after = time[top] - time[top - 1], time[top + 1] - time[top]
            rise, fall = (values[top] - values[top - 1]) / before, (values[top + 1] - values[top]) / after
            bend = (fall - rise) / (before + after)
            found[2, row] = 1.0 - max(values[top - 1], values[top + 1]) / max(values[top], 1e-300)
            if bend < 0.0:
                slope = rise + bend * before
                found[0, row] -= 0.25 * slope * slope / bend
                found[1, row] -= 0.5 * slope / bend
        else:
            found[2, row] = 0.0
        found[3, row] = 0.0
        for first, last in ((0, loading), (turn, len(time))):
            span = indentations[row, last - 1] - indentations[row, first]
            part, here = time[first:last], values[first:last]
            area = monotone_integral(part, here, monotone_slopes(part, here))
            found[3, row] -= area * span / (part[-1] - part[0])
    return found
