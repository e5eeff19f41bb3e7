"""Identify a contact from one noisy force curve: Tabor parameter and modulus ratio, with their uncertainty.

The solver runs inside a least-squares fit. Both parameters are fitted as logarithms, which keeps them positive; the
covariance is that of the linearised problem at the solution, scaled by the residual's variance, so it holds where noise
is independent from point to point and the model is right.

Run: `python examples/identify_material.py`.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from bem import LoadingProtocol, Scene, StandardLinearSolid, simulate
from bem.dataset.measurement_steps import measurement_times

PROTOCOL = LoadingProtocol(
    peak_indentation=5.0, loading_rate=5.0, dwell_time=1.0, unloading_rate=5.0, start_indentation=-3.0
)


@dataclass(frozen=True)
class Identified:
    """Estimates, and the factor by which each may be off at 95 % confidence."""

    tabor: float
    modulus_ratio: float
    tabor_factor: float
    modulus_ratio_factor: float
    noise: float
    simulations: int


def measured_curve(tabor: float, modulus_ratio: float, noise: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Instants and forces a laboratory might record: the solver's, at standard accuracy, with noise."""
    times = measurement_times(PROTOCOL, tabor)
    scene = Scene(tabor, StandardLinearSolid(modulus_ratio=modulus_ratio))
    force = simulate(scene, PROTOCOL, accuracy="standard").at(times)
    return times, force + noise * np.random.default_rng(seed).standard_normal(times.size)


def identify(times: np.ndarray, force: np.ndarray, guess: tuple[float, float] = (1.0, 0.3)) -> Identified:
    """Fit Tabor parameter and modulus ratio to a force curve of `PROTOCOL`.

    Args:
        times: Instants of shape `(n,)`.
        force: Measured forces of the same shape.
        guess: Tabor parameter and modulus ratio to start from.

    Raises:
        RuntimeError: the fit did not converge.
    """
    simulations = 0

    def residual(logarithms: np.ndarray) -> np.ndarray:
        nonlocal simulations
        simulations += 1
        tabor, ratio = np.exp(logarithms)
        found = simulate(Scene(tabor, StandardLinearSolid(modulus_ratio=ratio)), PROTOCOL, accuracy="standard")
        # A fit must see that a failed simulation is bad, not that it is absent.
        return found.at(times) - force if found.completed else np.full(times.size, 1e3)

    # The finite difference must stand out of the solver's own discretisation error.
    fit = least_squares(
        residual,
        np.log(guess),
        bounds=(np.log([0.2, 0.02]), np.log([3.2, 0.99])),
        diff_step=2e-2,
        x_scale=[0.3, 0.3],
        xtol=1e-4,
        ftol=1e-6,
    )
    if not fit.success:
        raise RuntimeError(f"the fit did not converge: {fit.message}")
    free = times.size - 2
    variance = 2.0 * fit.cost / free
    spread = np.sqrt(np.diag(variance * np.linalg.inv(fit.jac.T @ fit.jac)))
    factors = np.exp(student.ppf(0.975, free) * spread)
    return Identified(
        *np.exp(fit.x).tolist(), *factors.tolist(), noise=float(np.sqrt(variance)), simulations=simulations
    )


def main() -> None:
    """Make a noisy curve, forget its parameters, and find them again."""
    argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0]).parse_args()  # it takes no argument
    true = (1.5, 0.15)
    found = identify(*measured_curve(*true, noise=0.05))
    for name, value, factor, expected in (
        ("tabor", found.tabor, found.tabor_factor, true[0]),
        ("modulus_ratio", found.modulus_ratio, found.modulus_ratio_factor, true[1]),
    ):
        print(f"{name:14} {value:.4f}, within a factor {factor:.4f} at 95 % (true {expected})")
    print(f"noise {found.noise:.4f}, {found.simulations} simulations")


if __name__ == "__main__":
    main()
