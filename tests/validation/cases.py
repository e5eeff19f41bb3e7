"""What the validation tests share: measures of a loop, and the sample of hard cases."""

from itertools import product

import numpy as np

from bem import LoadingProtocol, Scene, StandardLinearSolid, Trajectory, simulate
from bem.dataset.designs import PAPER_RANGES
from bem.problem.protocol import Protocol, default_start_indentation

RATES = (1e-3, 1e-1, 1e1, 1e3, 1e5)
VALUES = {
    "tabor": (0.02, 0.2, 1.0, 3.2, 5.0),
    "modulus_ratio": (1.0, 0.1, 0.01, 0.001),
    "loading_rate": RATES,
    "unloading_rate": RATES,
    "dwell_time": (0.0, 1e-6, 1.0, 1e3),
    "peak_indentation": (-1.0, 0.5, 10.0, 100.0, 500.0),
}
"""Extreme values, of which hard cases are combinations."""
SHALLOWEST = -0.02
"""Peak indentation that replaces a peak below the start, for which the sphere would only move away."""
# In the order in which a sample draws them.
DRAWN = ("tabor", "modulus_ratio", "peak_indentation", "loading_rate", "dwell_time", "unloading_rate")
DEEPEST_AT = 1.0  # the largest Tabor parameter at which the deepest peak is asked for

Case = tuple[Scene, LoadingProtocol]


def ramps(peak: float, loading: float, dwell: float, unloading: float, start: float | None = None) -> LoadingProtocol:
    """Load, hold and unload."""
    names = ("peak_indentation", "loading_rate", "dwell_time", "unloading_rate", "start_indentation")
    return LoadingProtocol(**dict(zip(names, (peak, loading, dwell, unloading, start), strict=True)))


def case(tabor, ratio, peak_indentation, loading_rate, dwell_time, unloading_rate) -> Case:
    """One scene and protocol."""
    protocol = ramps(peak_indentation, loading_rate, dwell_time, unloading_rate)
    return Scene(tabor=tabor, material=StandardLinearSolid(modulus_ratio=ratio)), protocol


def hard_cases(count: int, seed: int = 2) -> list[Case]:
    """Random combinations of extreme values; the same for the same seed, and longer samples begin with shorter ones."""
    rng = np.random.default_rng(seed)
    cases = []
    while len(cases) < count:
        tabor, ratio, peak, loading, dwell, unloading = (float(rng.choice(VALUES[name])) for name in DRAWN)
        if peak <= default_start_indentation(tabor):
            peak = SHALLOWEST
        if peak <= 100.0 or tabor <= DEEPEST_AT:
            cases.append(case(tabor, ratio, peak, loading, dwell, unloading))
    return cases


def corners_of_the_papers_box() -> list[Case]:
    """All 32 corners, with the paper's modulus ratio."""
    return [
        case(tabor, 0.1, peak, loading, dwell, unloading)
        for tabor, peak, loading, dwell, unloading in product(*PAPER_RANGES.values())
    ]


def drawn_from_the_papers_box(count: int, seed: int = 3) -> list[Case]:
    """Protocols off the paper's grid, each quantity but the Tabor parameter uniform in its logarithm."""
    rng = np.random.default_rng(seed)
    cases = []
    for _ in range(count):
        values = [low * (high / low) ** rng.random() for low, high in PAPER_RANGES.values()]
        cases.append(case(rng.uniform(*PAPER_RANGES["tabor"]), 0.1, *values[1:]))
    return cases


def completed(scene: Scene, protocol: Protocol, accuracy: str | float = "standard", **options) -> Trajectory:
    """The trajectory of a simulation that must come to its end."""
    trajectory = simulate(scene, protocol, accuracy, **options)
    assert trajectory.completed, trajectory.status
    return trajectory


def exchanged_energy(trajectory: Trajectory) -> float:
    """Integral of |P d(delta)|, what the work of a loop is to be compared with."""
    force = 0.5 * np.abs(trajectory.force[1:] + trajectory.force[:-1])
    return float(np.sum(force * np.abs(np.diff(trajectory.indentation))))


def stage_area(trajectory: Trajectory) -> float:
    """Integral of -P d(stage) on a fine grid of instants; without a spring the stage is the sphere."""
    times = np.linspace(trajectory.time[0], trajectory.time[-1], 200_001)
    force, stage = trajectory.at(times), np.interp(times, trajectory.time, trajectory.stage)
    return -np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(stage))


def assert_sound(trajectory: Trajectory, *, created: float) -> None:
    """Completed, finite, and the loop creates no more than a fraction `created` of the energy it exchanges."""
    assert trajectory.completed, trajectory.status
    for name in ("time", "indentation", "force", "contact_radius"):
        assert np.all(np.isfinite(getattr(trajectory, name))), name
    assert np.all(np.diff(trajectory.time) >= 0.0)
    assert np.all(trajectory.contact_radius >= 0.0)
    assert trajectory.work() >= -created * exchanged_energy(trajectory)
    for jump in trajectory.jumps:
        assert abs(jump.eigenvalue_before) < 0.1, jump  # at a fold it vanishes
        assert jump.eigenvalue_after > 0.0, jump
