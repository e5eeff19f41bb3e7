"""What the validation tests share: measures of a loop, and the sample of hard cases."""

from itertools import product

import numpy as np

from bem import LoadingProtocol, Scene, StandardLinearSolid, Trajectory
from bem.protocol import default_start_indentation

TABORS = (0.02, 0.2, 1.0, 3.2, 5.0)
MODULUS_RATIOS = (1.0, 0.1, 0.01, 0.001)
RATES = (1e-3, 1e-1, 1e1, 1e3, 1e5)
DWELL_TIMES = (0.0, 1e-6, 1.0, 1e3)
PEAKS = (-1.0, 0.5, 10.0, 100.0, 500.0)
SHALLOWEST = -0.02  # instead of a peak below the start, where the sphere would move away
DEEPEST_AT = 1.0  # the largest Tabor parameter at which the deepest peak is asked for
PAPER_BOX = {
    "tabor": (0.2, 3.2),
    "peak_indentation": (2.0, 100.0),
    "loading_rate": (0.1, 1000.0),
    "dwell_time": (1e-3, 3.0),
    "unloading_rate": (0.1, 1000.0),
}

Case = tuple[Scene, LoadingProtocol]


def case(tabor, ratio, peak_indentation, loading_rate, dwell_time, unloading_rate) -> Case:
    """One scene and protocol."""
    protocol = LoadingProtocol(
        peak_indentation=peak_indentation,
        loading_rate=loading_rate,
        dwell_time=dwell_time,
        unloading_rate=unloading_rate,
    )
    return Scene(tabor=tabor, material=StandardLinearSolid(modulus_ratio=ratio)), protocol


def hard_cases(count: int, seed: int = 2) -> list[Case]:
    """Random combinations of extreme values; the same for the same seed, and longer samples begin with shorter ones."""
    rng = np.random.default_rng(seed)
    cases = []
    while len(cases) < count:
        tabor, ratio, peak, loading, dwell, unloading = (
            float(rng.choice(values)) for values in (TABORS, MODULUS_RATIOS, PEAKS, RATES, DWELL_TIMES, RATES)
        )
        if peak <= default_start_indentation(tabor):
            peak = SHALLOWEST
        if peak <= 100.0 or tabor <= DEEPEST_AT:
            cases.append(case(tabor, ratio, peak, loading, dwell, unloading))
    return cases


def corners_of_the_papers_box() -> list[Case]:
    """All 32 corners, with the paper's modulus ratio."""
    return [
        case(tabor, 0.1, peak, loading, dwell, unloading)
        for tabor, peak, loading, dwell, unloading in product(*PAPER_BOX.values())
    ]


def drawn_from_the_papers_box(count: int, seed: int = 3) -> list[Case]:
    """Protocols off the paper's grid, each quantity but the Tabor parameter uniform in its logarithm."""
    rng = np.random.default_rng(seed)
    cases = []
    for _ in range(count):
        values = [low * (high / low) ** rng.random() for low, high in PAPER_BOX.values()]
        cases.append(case(rng.uniform(*PAPER_BOX["tabor"]), 0.1, *values[1:]))
    return cases


def exchanged_energy(trajectory: Trajectory) -> float:
    """Integral of |P d(delta)|, what the work of a loop is to be compared with."""
    force = 0.5 * np.abs(trajectory.force[1:] + trajectory.force[:-1])
    return float(np.sum(force * np.abs(np.diff(trajectory.indentation))))


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
