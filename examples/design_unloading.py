"""Design a release: the unloading rate and the dwell that give a wanted pull-off force.

Keras can differentiate its model, so the design goes downhill on the square of the error of the pull-off force, by
the gradient of the surrogate by both quantities, from a dozen starts at once. The answer is then checked with the
solver and polished: the dwell stays, and the unloading rate is corrected by secants of the solver until it agrees. Two
unknowns for one wish leave a family of answers; among those found, this takes the one of least dwell and rate.

Run: `python examples/design_unloading.py` (needs the extra `train`).
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np

import surrogate
from bem import LoadingProtocol, Scene, StandardLinearSolid, simulate
from surrogate.data.scaling import Scaling

COUNTS = (50, 20, 50)
STARTS = 12


@dataclass(frozen=True)
class Release:
    """A designed release, and how well surrogate and solver agree on it."""

    unloading_rate: float
    dwell_time: float
    predicted: float
    simulated: float
    unpolished: float
    simulations: int


def design(
    model: surrogate.Surrogate,
    *,
    wanted: float,
    tabor: float = 2.0,
    peak_indentation: float = 10.0,
    loading_rate: float = 10.0,
    steps: int = 60,
    tolerance: float = 0.005,
) -> Release:
    """Find unloading rate and dwell for a wanted pull-off force.

    Args:
        model: A surrogate loaded with the Keras backend on TensorFlow.
        wanted: The pull-off force, P / (pi R dgamma).
        tabor: Tabor parameter.
        peak_indentation: Indentation before the release.
        loading_rate: Speed of approach.
        steps: Steps of the gradient descent.
        tolerance: Relative error that ends the polishing.

    Raises:
        RuntimeError: the solver does not come near the wish in a dozen corrections.
    """
    fixed = {"tabor": tabor, "peak_indentation": peak_indentation, "loading_rate": loading_rate}
    logarithms, pull_off = descend(model, wanted, fixed, steps)
    # Of all starts that arrived, the least demanding answer.
    error = np.abs(pull_off / wanted - 1.0)
    arrived = error <= max(0.01, 1.5 * error.min())
    best = np.flatnonzero(arrived)[np.argmin(logarithms[arrived].sum(axis=1))]
    log_rate, log_dwell = (float(value) for value in logarithms[best])

    scene = Scene(tabor, StandardLinearSolid(modulus_ratio=0.1))
    low, high = np.log(model.scaling.ranges["unloading_rate"])
    tried: list[tuple[float, float]] = []
    # Adhesion grows with a power of the rate between zero and one; a third is typical.
    power = 1.0 / 3.0
    for _ in range(12):
        protocol = LoadingProtocol(
            peak_indentation=peak_indentation,
            loading_rate=loading_rate,
            dwell_time=float(np.exp(log_dwell)),
            unloading_rate=float(np.exp(log_rate)),
        )
        force = simulate(scene, protocol, accuracy="standard").pull_off_force
        tried.append((log_rate, float(force)))
        if abs(force / wanted - 1.0) <= tolerance:
            return Release(
                unloading_rate=protocol.unloading_rate,
                dwell_time=protocol.dwell_time,
                predicted=float(pull_off[best]),
                simulated=float(force),
                unpolished=tried[0][1],
                simulations=len(tried),
            )
        if len(tried) > 1:
            (rate_before, force_before), (rate_now, force_now) = tried[-2:]
            power = np.clip(np.log(force_now / force_before) / (rate_now - rate_before), 0.05, 2.0)
        log_rate = float(np.clip(log_rate + np.log(wanted / force) / power, low, high))
        if log_rate == tried[-1][0]:
            break
    raise RuntimeError(
        f"no unloading rate in the trained range gives a pull-off force of {wanted}; nearest {tried[-1][1]:.4g}"
    )


def descend(
    model: surrogate.Surrogate, wanted: float, fixed: dict[str, float], steps: int
) -> tuple[np.ndarray, np.ndarray]:
    """Go downhill from many starts; return logarithms of rate and dwell, and the pull-off forces there."""
    import tensorflow as tf

    ranges = np.log([model.scaling.ranges[name] for name in ("unloading_rate", "dwell_time")])
    starts = ranges[:, 0] + np.random.default_rng(0).random((STARTS, 2)) * np.ptp(ranges, axis=1)
    variables = tf.Variable(starts, dtype=tf.float64)
    mean, deviation = model.scaling.force
    aim = (np.log1p(abs(wanted)) - mean) / deviation
    rate = 0.15

    @tf.function
    def look() -> tuple[tf.Tensor, tf.Tensor]:
        with tf.GradientTape() as tape:
            sequence, tabor = scaled_inputs(model.scaling, variables, fixed)
            scaled = model.model([sequence, tabor], training=False)[:, COUNTS[0] + COUNTS[1] - 1 :, 0]
            peak = tf.cast(tf.reduce_max(scaled, axis=1), tf.float64)
            loss = tf.reduce_sum((peak - aim) ** 2)
        return peak, tape.gradient(loss, variables)

    first, second = np.zeros_like(starts), np.zeros_like(starts)
    best, best_peak = starts.copy(), np.full(STARTS, np.inf)
    for step in range(1, steps + 1):
        peak, gradient = (tensor.numpy() for tensor in look())
        better = np.abs(peak - aim) < np.abs(best_peak - aim)
        best[better], best_peak[better] = variables.numpy()[better], peak[better]
        # Adam, whose steps do not depend on the scale of the loss; the box of the training is kept.
        first = 0.9 * first + 0.1 * gradient
        second = 0.99 * second + 0.01 * gradient**2
        update = (first / (1 - 0.9**step)) / (np.sqrt(second / (1 - 0.99**step)) + 1e-12)
        variables.assign(np.clip(variables.numpy() - rate * update, ranges[:, 0], ranges[:, 1]))
    return best, model.scaling.unscale_force(best_peak)


def scaled_inputs(scaling: Scaling, variables: object, fixed: dict[str, float]) -> tuple[object, object]:
    """Measurement steps and channels of feature set D as TensorFlow computes them, so that gradients pass."""
    import tensorflow as tf

    if scaling.features != "D":
        raise ValueError(f"Expected a model of feature set D. Received: {scaling.features}")
    rate, dwell = tf.exp(variables[:, :1]), tf.exp(variables[:, 1:])
    start = -(np.pi ** (2 / 3)) * fixed["tabor"]
    travel = fixed["peak_indentation"] - start
    onset = travel / fixed["loading_rate"]
    up, down = np.linspace(0.0, 1.0, COUNTS[0])[None], (np.arange(1, COUNTS[2] + 1) / COUNTS[2])[None]
    still = (np.arange(1, COUNTS[1] + 1) / COUNTS[1])[None]
    ones = tf.ones_like(rate)
    times = tf.concat([onset * up * ones, onset + dwell * still, onset + dwell + travel / rate * down], axis=1)
    rise = np.concatenate([up, np.ones_like(still), 1.0 - down], axis=1)
    depths = (start + travel * rise) * ones
    speed = tf.concat([0.0 * ones, (depths[:, 1:] - depths[:, :-1]) / (times[:, 1:] - times[:, :-1])], axis=1)
    edge = np.zeros((1, sum(COUNTS)))
    edge[0, [COUNTS[0] - 1, COUNTS[0] + COUNTS[1] - 1]] = 1.0

    def symlog(values: object) -> object:
        return tf.sign(values) * tf.math.log1p(tf.abs(values))

    columns = tf.stack([symlog(symlog(times)), symlog(depths), symlog(speed), edge * ones], axis=-1)
    columns = (columns - np.array(scaling.channel_mean)) / np.array(scaling.channel_scale)
    tabor = scaling.scale_tabor(np.full(STARTS, fixed["tabor"]))
    return tf.cast(columns, tf.float32), tf.constant(tabor)


def main() -> None:
    """Design one release and say how it came out."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--model", default="M1-concat")
    parser.add_argument("--wanted", type=float, default=5.0)
    chosen = parser.parse_args()
    plan = design(surrogate.load(chosen.model, backend="keras"), wanted=chosen.wanted)
    print(
        f"unload at {plan.unloading_rate:.4g} after a dwell of {plan.dwell_time:.4g}: the surrogate says "
        f"{plan.predicted:.4g}, the solver {plan.unpolished:.4g} before and {plan.simulated:.4g} after polishing "
        f"({plan.simulations} simulations, wanted {chosen.wanted:g})"
    )


if __name__ == "__main__":
    main()
