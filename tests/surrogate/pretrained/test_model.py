import warnings

import numpy as np
import pytest

import surrogate
from bem import LoadingProtocol
from bem.dataset.physical_steps import physical_grid
from surrogate import ExtrapolationWarning
from surrogate.data.features import channels, edge_from_counts
from surrogate.pretrained.model import Pretrained

COUNTS = (22, 8, 72)
QUANTITIES = {"peak_indentation": 20.0, "loading_rate": 10.0, "dwell_time": 1.0, "unloading_rate": 10.0}
PROTOCOL = LoadingProtocol(**QUANTITIES)


def test_a_trajectory_has_the_force_of_the_network_on_physical_steps(model):
    (found,) = model.trajectories(PROTOCOL, tabor=1.0, modulus_ratio=0.1)
    times, indentations = physical_grid(tabor=1.0, **QUANTITIES, modulus_ratio=0.1)
    np.testing.assert_array_equal(found.time, times[0])
    np.testing.assert_array_equal(found.indentation, indentations[0])
    sequence = channels(times, indentations, edge_from_counts(COUNTS, 1), "F", tabor=np.ones(1), modulus_ratio=0.1)
    tabor = np.broadcast_to(model.scaling.scale_tabor(np.ones(1))[:, np.newaxis], (1, 102, 1))
    inputs = np.concatenate([model.scaling.scale_channels(sequence), tabor], axis=2).transpose(1, 0, 2)
    expected = model.scaling.unscale_force(model.network(np.ascontiguousarray(inputs)))
    np.testing.assert_allclose(found.force, expected[0], rtol=1e-4)
    assert found.pull_off_force >= found.force[29:].max()
    assert found.hysteresis == abs(found.work())
    assert found.unloading.sum() == 73
    assert found.model == "fast"


def test_bands_contain_the_prediction_and_widen_with_coverage(model):
    narrow, wide = (
        model.trajectories(PROTOCOL, tabor=1.0, modulus_ratio=0.1, coverage=coverage)[0] for coverage in (0.5, 0.95)
    )
    for found in (narrow, wide):
        low, high = found.pull_off_interval
        assert low < found.pull_off_force < high
        assert np.all(found.force_lower < found.force)
        assert np.all(found.force < found.force_upper)
    assert wide.pull_off_interval[0] < narrow.pull_off_interval[0]
    assert np.all(wide.force_upper >= narrow.force_upper)


def test_a_batch_is_what_its_members_are(model):
    protocols = [
        LoadingProtocol(**{**QUANTITIES, "unloading_rate": float(rate)}) for rate in np.geomspace(0.2, 900, 300)
    ]
    tabor, ratio = np.linspace(0.3, 3.0, 300), np.geomspace(0.02, 0.9, 300)
    batch = model.trajectories(protocols, tabor=tabor, modulus_ratio=ratio)
    for row in (0, 127, 128, 299):
        (alone,) = model.trajectories(protocols[row], tabor=tabor[row], modulus_ratio=ratio[row])
        assert batch[row].pull_off_force == pytest.approx(alone.pull_off_force, rel=1e-5)
        assert batch[row].modulus_ratio == ratio[row]
        np.testing.assert_array_equal(batch[row].time, alone.time)


@pytest.mark.parametrize(
    ("changes", "tabor", "ratio", "name"),
    [
        ({"unloading_rate": 1e4}, 1.0, 0.1, "unloading_rate"),
        ({"dwell_time": 0.0}, 1.0, 0.1, "dwell_time"),
        ({}, 5.0, 0.1, "tabor"),
        ({}, 1.0, 0.001, "modulus_ratio"),
        ({"start_indentation": -9.0}, 1.0, 0.1, "start_indentation"),
    ],
)
def test_outside_the_training_bands_are_infinite_and_one_warning_says_so(model, changes, tabor, ratio, name):
    protocols = [PROTOCOL, LoadingProtocol(**{**QUANTITIES, **changes})]
    with pytest.warns(ExtrapolationWarning, match=rf"of 2 protocols lie outside the training of fast.*{name}") as told:
        inside, outside = model.trajectories(protocols, tabor=[1.0, tabor], modulus_ratio=[0.1, ratio])
    assert len(told) == 1
    assert inside.extrapolated == ()
    assert np.isfinite(inside.pull_off_interval).all()
    assert name in outside.extrapolated[0]
    assert outside.pull_off_interval == (-np.inf, np.inf)
    assert np.all(outside.force_upper == np.inf)
    assert np.isfinite(outside.pull_off_force)
    assert "pull_off_interval" not in outside.summary()


def test_inside_nothing_is_said(model):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert model.trajectories([], tabor=1.0, modulus_ratio=0.1) == []
        (found,) = model.trajectories([PROTOCOL], tabor=1.0, modulus_ratio=1.0)
    assert found.summary()["pull_off_interval"] == list(found.pull_off_interval)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"modulus_ratio": 0.0}, r"Expected modulus ratios in \(0, 1\]. Received: modulus_ratio=0.0"),
        ({"modulus_ratio": [0.1, 0.2]}, "Expected one modulus ratio per protocol"),
        ({"tabor": -1.0}, "Expected finite Tabor parameters above zero"),
        ({"coverage": 1.0}, "coverage must be"),
        ({"protocols": [3]}, "Expected LoadingProtocols. Received: 3"),
        ({"protocols": [LoadingProtocol(**{**QUANTITIES, "peak_indentation": -0.5})]}, "must lie above 0"),
    ],
)
def test_bad_input_gets_one_sentence(model, arguments, message):
    arguments = {"protocols": PROTOCOL, "tabor": 1.0, "modulus_ratio": 0.1} | arguments
    with pytest.raises(ValueError, match=message):
        model.trajectories(arguments.pop("protocols"), **arguments)


def test_load_finds_it_by_name(untrained):
    assert isinstance(surrogate.load("fast", untrained.parent), Pretrained)
    with pytest.raises(FileNotFoundError, match=r"pretrained model accurate in .*`make pretrained` trains it"):
        surrogate.load("accurate", untrained.parent)
    with pytest.raises(ValueError, match=r"Expected the backend 'onnx' for fast. Received: backend='keras'"):
        surrogate.load("fast", untrained.parent, backend="keras")


@pytest.mark.parametrize("name", ["run.json", "bands.npz"])
def test_a_damaged_folder_is_refused(untrained, name):
    (untrained / name).write_text("{")
    with pytest.raises(ValueError, match=r"Expected a folder of `make pretrained`. Received: .*damaged"):
        Pretrained(untrained)
    (untrained / name).unlink()
    with pytest.raises(FileNotFoundError, match=name):
        Pretrained(untrained)
