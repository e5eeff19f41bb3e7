"""Closed forms as tools: what each computes, for which protocols it is meant, and how to call it.

A form is used only inside its regime of Tabor parameter and rate. A form without memory requires that both ramps last
at least `SLOW` retardation times, or that the whole protocol lasts at most `FAST`. A form without adhesion requires
that adhesion is at most `NEGLIGIBLE` of the largest force. DMT requires a long range of adhesion, JKR a short one. The
energy of Persson and Brener is integrated along the retreat of a JKR edge from the relaxed contact, and gives the
pull-off force alone. An answer is that of `experiments.measurements.tools`, NaN where a form gives nothing.

Sources: the modules of `bem.methods.closed_forms`. Units as there.
"""

from collections.abc import Callable
from types import ModuleType
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from bem.dataset.measurement_steps import FIRST_UNLOADING
from bem.methods.closed_forms import dmt, hereditary_hertz, hertz, jkr, maugis_dugdale, persson_brener
from experiments.cases import Case
from experiments.common import MODULUS_RATIO

SLOW, FAST = 10.0, 0.1
NEGLIGIBLE = 0.1
LONG_RANGE, SHORT_RANGE = 0.4, 2.0
RELAXED = 2.0  # retardation times before and during unloading, from which on the contact counts as relaxed


class Form(NamedTuple):
    """A closed form: its name, its regime, and the tool."""

    name: str
    meant_for: Callable[[Case], bool]
    answer: Callable[[Case], np.ndarray]


def answer(pull_off: float, force: np.ndarray | None = None) -> np.ndarray:
    """The answer that holds a pull-off force and forces of shape (120,); no closed form gives a hysteresis."""
    return np.concatenate([[pull_off, np.nan], np.full(120, np.nan) if force is None else force])


def slow(case: Case) -> bool:
    """Whether both ramps last at least `SLOW` retardation times."""
    t0, t1, t2, t3 = case.protocol.phase_times(case.scene.tabor)
    return min(t1 - t0, t3 - t2) >= SLOW


def fast(case: Case) -> bool:
    """Whether the whole protocol lasts at most `FAST` retardation times."""
    return case.protocol.phase_times(case.scene.tabor)[3] <= FAST


def hardly_adhesive(case: Case, stiffening: float = 1.0) -> bool:
    """Whether adhesion is negligible beside `stiffening` times the largest rubbery Hertz force."""
    largest = -stiffening * float(hertz.force_from_indentation(case.protocol.peak_indentation, case.scene.tabor))
    return NEGLIGIBLE * largest >= dmt.PULL_OFF_FORCE


def _hertz(case: Case, stiffening: float) -> np.ndarray:
    return answer(np.nan, stiffening * hertz.force_from_indentation(case.grid()[1], case.scene.tabor))


def _lee_radok(case: Case) -> np.ndarray:
    history = case.protocol.history(case.scene.tabor)
    times, depths = case.grid()
    force = np.where(depths > 0.0, hereditary_hertz.force(case.scene, history, times), 0.0)
    force[FIRST_UNLOADING + 1 :] = np.nan  # the contact shrinks
    return answer(np.nan, force)


def _retreat(case: Case) -> np.ndarray:
    """Largest force while the edge of a JKR contact retreats with the energy of Persson and Brener at its speed."""
    mu, protocol = case.scene.tabor, case.protocol
    radius = float(jkr.contact_radius_from_indentation(protocol.peak_indentation, mu))
    unit = 1.0 / persson_brener.beta_over_length_scale(mu)  # l0 in beta

    def energy(a: np.ndarray, t: np.ndarray) -> np.ndarray:
        return (a**2 - (protocol.peak_indentation - protocol.unloading_rate * t) / mu) ** 2 / (2.0 * np.pi * a)

    def speed(t: float, state: np.ndarray) -> list[float]:
        release_rate = float(np.clip(energy(state[0], t), 1.0, (1.0 - 1e-9) / MODULUS_RATIO))
        return [-unit * float(persson_brener.crack_velocity(release_rate, MODULUS_RATIO))]

    def lost(t: float, state: np.ndarray) -> float:  # noqa: ARG001
        return state[0] - 0.05 * radius

    lost.terminal = True  # type: ignore[attr-defined]
    end = case.protocol.phase_times(mu)
    solution = solve_ivp(speed, (0.0, end[3] - end[2]), [radius], "LSODA", rtol=1e-5, events=lost)
    a, g = solution.y[0], np.maximum(energy(solution.y[0], solution.t), 1.0)
    return answer(float(np.max(np.sqrt(8.0 * g * a**3 / np.pi) - 4.0 * a**3 / (3.0 * np.pi))))


def _relaxed(case: Case) -> bool:
    times = case.protocol.phase_times(case.scene.tabor)
    return times[2] >= RELAXED and times[3] - times[2] >= RELAXED


def _elastic(form: ModuleType) -> Callable[[Case], np.ndarray]:
    def found(case: Case) -> np.ndarray:
        tabor = case.scene.tabor
        pull_off = form.PULL_OFF_FORCE if form is not maugis_dugdale else form.pull_off_force(tabor)
        return answer(pull_off, form.force_from_indentation(case.grid()[1], tabor))

    return found


GLASSY = 1.0 / MODULUS_RATIO
FORMS = (
    Form("Hertz, rubbery", lambda c: slow(c) and hardly_adhesive(c), lambda c: _hertz(c, 1.0)),
    Form("Hertz, glassy", lambda c: fast(c) and hardly_adhesive(c, GLASSY), lambda c: _hertz(c, GLASSY)),
    Form("Lee and Radok, until the peak", hardly_adhesive, _lee_radok),
    Form("DMT, rubbery", lambda c: slow(c) and c.scene.tabor <= LONG_RANGE, _elastic(dmt)),
    Form("Maugis-Dugdale, rubbery", slow, _elastic(maugis_dugdale)),
    Form("JKR, rubbery", lambda c: slow(c) and c.scene.tabor >= SHORT_RANGE, _elastic(jkr)),
    Form("Persson-Brener, pull-off", lambda c: _relaxed(c) and c.scene.tabor >= SHORT_RANGE, _retreat),
)
