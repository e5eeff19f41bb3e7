"""Contact without adhesion: the closed forms against Ting's solution and against the mesh.

Source: Ting, J. Appl. Mech. 33 (1966) 845.
"""

import itertools

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from bem import ForceProtocol, HardContact, PiecewiseLinearProtocol, PronySeries, Scene
from bem.methods.boundary_elements.meshes.mesh import uniform_mesh
from bem.problem.materials import Elastic, StandardLinearSolid, relaxation_spectrum
from tests.validation.cases import completed, ramps

SLS, SERIES = StandardLinearSolid(0.1), PronySeries([0.4, 0.4], [0.1, 10.0])
CYCLE = ramps(4.0, 4.0, 0.3, 5.0, 0.0)
TWICE = PiecewiseLinearProtocol([0.0, 0.5, 1.0, 1.2, 2.0, 2.5, 3.5], [-1.0, 4.0, 4.0, 1.0, 5.0, 5.0, -1.0])
APART = PiecewiseLinearProtocol([0.0, 0.5, 0.7, 0.8, 1.5, 2.5], [-1.0, 4.0, -1.0, 2.0, 4.0, 0.0])
LOADS = ForceProtocol([0.0, 0.1, 2.0, 2.5, 3.0], [0.0, -5.0, -5.0, -1.0, -4.0])


def ting(material, path, tabor, time):
    """Force at a time of a history that rises, rests and falls, from Hertz's law up to an equal radius."""
    moduli, relaxations = relaxation_spectrum(material)
    corners, depths = path.times, path.indentations

    def modulus(age):
        return 1.0 + np.sum(moduli * np.exp(-age / relaxations))

    def integral(function, begin, end):
        ends = [begin, *corners[(corners > begin) & (corners < end)], end]
        return sum(quad(function, a, b, epsabs=1e-11)[0] for a, b in itertools.pairwise(ends))

    def rate(s):
        return path.rates[min(np.searchsorted(corners, s, side="right"), depths.size - 1) - 1]

    def moved(begin):
        return integral(lambda s: modulus(time - s) * rate(s), begin, time)

    reached = time
    if time > corners[-2]:
        if moved(0.0) < 0.0:
            return 0.0
        reached = brentq(moved, 0.0, corners[1])
    scale = -2.0 / (np.pi * tabor**1.5)
    return scale * integral(
        lambda s: modulus(time - s) * np.sqrt(path.indentation_at(s)) * rate(s), 0.0, min(reached, corners[-1])
    )


@pytest.mark.parametrize("material", [SLS, StandardLinearSolid(0.01), SERIES])
@pytest.mark.parametrize("accuracy", ["standard", 2e-4])
def test_one_cycle_is_tings(material, accuracy):
    trajectory = completed(Scene(1.3, material, HardContact()), CYCLE, accuracy)
    path = CYCLE.history(1.3)
    times = np.concatenate([np.linspace(0.02, 1.0, 9), np.linspace(1.01, 1.3, 5), np.linspace(1.301, 2.09, 20)])
    exact = np.array([ting(material, path, 1.3, time) for time in times])
    assert trajectory.stats.method == "elements"
    assert np.max(np.abs(trajectory.at(times) - exact)) < trajectory.accuracy * np.ptp(exact)
    assert np.count_nonzero(exact == 0.0) > 2


@pytest.mark.parametrize("glassy", [False, True])
@pytest.mark.parametrize(
    ("material", "spring", "protocol", "method"),
    [
        (Elastic(), None, TWICE, "Hertz"),
        (Elastic(), 0.5, TWICE, "Hertz"),
        (Elastic(), None, LOADS, "Hertz"),
        (SLS, None, TWICE, "elements"),
        (SERIES, None, APART, "elements"),
        (SLS, 0.5, APART, "elements"),
        (SERIES, 20.0, TWICE, "elements"),
        (SLS, None, LOADS, "elements"),
        (SERIES, None, LOADS, "elements"),
    ],
)
def test_a_mesh_of_ones_own_gives_the_same(material, spring, protocol, method, glassy):
    scene, initial = Scene(1.0, material, HardContact(), spring), "glassy" if glassy else "relaxed"
    trajectory = completed(scene, protocol, 1e-3, initial_state=initial)
    meshed = completed(scene, protocol, 1e-3, initial_state=initial, mesh=uniform_mesh(2.6, 260))
    assert (trajectory.stats.method, meshed.stats.method) == (method, "boundary elements")
    times = np.linspace(0.0, trajectory.time[-1], 1000)
    ours, theirs = (
        np.interp(times, of.time, of.indentation) if trajectory.by_force else of.at(times)
        for of in (trajectory, meshed)
    )
    assert np.max(np.abs(ours - theirs)) < 4e-3 * np.ptp(theirs)
    # the mesh takes half a spacing as the doubt of the edge
    radius = np.interp(times, meshed.time, meshed.contact_radius) - np.interp(
        times, trajectory.time, trajectory.contact_radius
    )
    assert np.median(np.abs(radius)) < 0.01
    assert trajectory.hysteresis == pytest.approx(meshed.hysteresis, rel=5e-3, abs=2e-3 * meshed.turnover())


@pytest.mark.parametrize("tabor", [1e-6, 1.0, 1e4])
@pytest.mark.parametrize("ratio", [1e-3, 0.1, 0.999])
@pytest.mark.parametrize("rate", [1e-6, 1.0, 1e9])
def test_extreme_rates_are_hertz(tabor, ratio, rate):
    path = PiecewiseLinearProtocol([0.0, 4.0 / rate], [0.0, 4.0])
    trajectory = completed(Scene(tabor, StandardLinearSolid(ratio), HardContact()), path)
    soft = -4.0 / (3.0 * np.pi) * (4.0 / tabor) ** 1.5
    assert trajectory.stats.steps < 500
    stiffness = trajectory.force[-1] / soft
    assert 1.0 - 4e-3 < stiffness < (1.0 + 4e-3) / ratio
    if rate != 1.0:
        assert stiffness == pytest.approx(1.0 if rate < 1.0 else 1.0 / ratio, rel=4e-3)
