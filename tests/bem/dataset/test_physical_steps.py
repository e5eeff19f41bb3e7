import numpy as np

from bem import LoadingProtocol, Scene, StandardLinearSolid, simulate
from bem.dataset.measurement_steps import FMS, PHYSICAL, measurement_grid
from bem.dataset.physical_steps import FACTORS, on_steps, physical_grid, solids

# Protocols with pull-off peaks of different widths, the second narrower than a uniform step.
PROTOCOLS = {
    "tabor": np.array([1.0, 0.55]),
    "peak_indentation": np.array([20.0, 69.0]),
    "loading_rate": np.array([10.0, 1.2]),
    "dwell_time": np.array([1.0, 0.003]),
    "unloading_rate": np.array([1.0, 900.0]),
}
RATIOS = np.array([0.1, 0.04])


def test_phases_meet_the_corners_of_the_protocol():
    times, indentations = physical_grid(**PROTOCOLS, modulus_ratio=RATIOS)
    uniform, depths = measurement_grid(**PROTOCOLS, counts=PHYSICAL)
    corners = [0, PHYSICAL[0] - 1, PHYSICAL[0] + PHYSICAL[1] - 1, -1]
    assert times.shape == indentations.shape == (2, sum(PHYSICAL))
    np.testing.assert_allclose(times[:, corners], uniform[:, corners], rtol=1e-12)
    np.testing.assert_allclose(indentations[:, corners], depths[:, corners], rtol=1e-12)
    assert np.all(np.diff(times, axis=1) > 0.0)
    assert np.all(np.diff(indentations[:, corners[2] :], axis=1) < 0.0)


def test_fewer_of_them_find_a_narrow_peak_that_uniform_ones_miss():
    protocol = LoadingProtocol(**{name: float(values[1]) for name, values in PROTOCOLS.items() if name != "tabor"})
    found = simulate(Scene(0.55, StandardLinearSolid(0.04)), protocol)
    errors = []
    for times in (
        measurement_grid(**PROTOCOLS, counts=FMS)[0][1],
        physical_grid(**PROTOCOLS, modulus_ratio=RATIOS)[0][1],
    ):
        highest = found.at(np.minimum(times, found.time[-1])).max()
        errors.append(1.0 - highest / found.pull_off_force)
    assert errors[0] > 0.2
    assert errors[1] < 0.001


def test_steps_are_closest_to_each_other_at_the_pull_off():
    for row in range(2):
        values = {name: float(values[row]) for name, values in PROTOCOLS.items() if name != "tabor"}
        found = simulate(Scene(PROTOCOLS["tabor"][row], StandardLinearSolid(RATIOS[row])), LoadingProtocol(**values))
        times = physical_grid(**PROTOCOLS, modulus_ratio=RATIOS)[0][row]
        width = np.diff(times)[np.searchsorted(times, found.pull_off_time) - 1]
        assert width < 0.05 * (found.pull_off_time - times[sum(PHYSICAL[:2]) - 1 + 16])


def test_without_memory_the_force_vanishes_at_first_touch():
    protocols = np.stack([*PROTOCOLS.values(), -2.1 * PROTOCOLS["tabor"]])
    nowhere = np.zeros(len(FACTORS))
    elastic, soft = (on_steps(protocols, *solids(k), np.array(PHYSICAL), nowhere)[2] for k in (np.ones(2), RATIOS))
    np.testing.assert_allclose(elastic, 0.0, atol=1e-12)
    assert np.all(soft > 0.3)
