import numpy as np
import pytest

from bem import LoadingProtocol, Scene, StandardLinearSolid, simulate
from bem.dataset.physical_steps import physical_grid
from surrogate.data.features import channels, edge_from_counts
from surrogate.data.scaling import Scaling
from surrogate.pretrained.kernels import results, scaled_inputs

COUNTS = (22, 8, 72)
PROTOCOLS = {
    "tabor": np.array([1.0, 0.55, 2.0]),
    "peak_indentation": np.array([20.0, 69.0, 3.0]),
    "loading_rate": np.array([10.0, 1.2, 300.0]),
    "dwell_time": np.array([1.0, 0.003, 0.1]),
    "unloading_rate": np.array([1.0, 900.0, 20.0]),
}
RATIOS = np.array([0.1, 0.04, 0.5])


def test_inputs_are_the_scaled_channels_and_the_tabor_parameter():
    times, indentations = physical_grid(**PROTOCOLS, modulus_ratio=RATIOS)
    tabor = PROTOCOLS["tabor"]
    found = channels(times, indentations, edge_from_counts(COUNTS, 3), "F", tabor=tabor, modulus_ratio=RATIOS)
    scaling = Scaling.fit(found, tabor=tabor, force=np.ones((3, 2)), features="F")
    moments = np.array([*zip(scaling.channel_mean, scaling.channel_scale, strict=True), scaling.tabor]).T.copy()
    inputs = scaled_inputs(times, indentations, tabor, RATIOS, np.array(COUNTS), *moments)
    assert inputs.dtype == np.float32
    np.testing.assert_allclose(inputs[..., :12].transpose(1, 0, 2), scaling.scale_channels(found), atol=2e-6)
    np.testing.assert_allclose(inputs[..., 12], np.broadcast_to(scaling.scale_tabor(tabor)[:, 0], (102, 3)), atol=1e-6)


@pytest.mark.parametrize("row", range(3))
def test_results_of_the_solvers_own_forces_are_the_solvers_results(row):
    protocol = LoadingProtocol(**{name: float(values[row]) for name, values in PROTOCOLS.items() if name != "tabor"})
    true = simulate(Scene(float(PROTOCOLS["tabor"][row]), StandardLinearSolid(float(RATIOS[row]))), protocol)
    times, indentations = physical_grid(**PROTOCOLS, modulus_ratio=RATIOS)
    force = true.at(np.minimum(times[row], true.time[-1]))[np.newaxis]
    pull_off, instant, sharpness, work = results(
        times[row : row + 1], indentations[row : row + 1], force, np.array(COUNTS)
    )
    assert pull_off[0] == pytest.approx(true.pull_off_force, rel=0.02)
    assert pull_off[0] >= force.max()
    assert instant[0] == pytest.approx(true.pull_off_time, rel=0.01)
    assert work[0] == pytest.approx(true.hysteresis, rel=0.05)
    assert 0.0 <= sharpness[0] < 0.5
