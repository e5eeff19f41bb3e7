"""The worked examples do what they promise, with a stand-in where they need a trained model."""

import importlib.util
import sys

import numpy as np
import pytest

import surrogate
from bem.lab import ForceCurve, fit
from bem.lab.fitting import guess_setup
from surrogate.data.scaling import Scaling
from surrogate.model import Surrogate
from surrogate.networks import KerasNetwork
from tests.processes import ROOT

EXAMPLES = ROOT / "examples"


def example(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    # Dataclasses look their module up by name.

    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def model():
    """A model of random weights: the examples must correct what a surrogate gets wrong."""
    scaling = Scaling(
        features="D",
        channel_mean=(0.6, 2.0, 0.5, 0.0),
        channel_scale=(0.3, 1.4, 3.0, 0.1),
        tabor=(0.7, 0.4),
        force=(-2.0, 2.5),
        ranges={"tabor": (0.2, 3.2), "unloading_rate": (0.1, 1000.0), "dwell_time": (1e-3, 3.0)},
    )
    network = surrogate.build("M1-gated")
    rng = np.random.default_rng(0)
    network.set_weights(
        [0.3 * rng.standard_normal(weight.shape) / np.sqrt(weight.shape[0]) for weight in network.get_weights()]
    )
    return Surrogate(KerasNetwork(network, scaling, name="M1-gated"))


def test_hold_force():
    hold = example("hold_force").hold
    loose, held = (hold(target=1.0, controlled=controlled) for controlled in (False, True))
    assert loose.force[-20:].mean() < -3.0
    assert held.force[-20:].mean() == pytest.approx(1.0, abs=0.2)
    assert np.abs(held.force[-20:] - 1.0).max() < 0.6
    # The base drifts towards the half-space, so the command must move away.
    assert held.command[-1] < held.command[20]


def test_design_unloading(model):
    plan = example("design_unloading").design(model, wanted=5.0, steps=10)
    assert plan.simulated == pytest.approx(5.0, rel=0.005)
    assert plan.simulations <= 12
    assert 0.1 <= plan.unloading_rate <= 1000.0
    assert 1e-3 <= plan.dwell_time <= 3.0


def test_design_refuses_unreachable_force(model):
    with pytest.raises(RuntimeError, match="no unloading rate in the trained range"):
        example("design_unloading").design(model, wanted=500.0, steps=2)


def test_gradient_channels_equal_predictor(model):
    import tensorflow as tf

    from bem.dataset.measurement_steps import measurement_grid
    from surrogate.data.features import channels, edge_from_counts

    module = example("design_unloading")
    fixed = {"tabor": 2.0, "peak_indentation": 10.0, "loading_rate": 10.0}
    logarithms = np.log(np.tile([[30.0, 0.5]], (module.STARTS, 1)))
    scaled, tabor = module.scaled_inputs(model.scaling, tf.constant(logarithms), fixed)
    times, depths = measurement_grid(**fixed, unloading_rate=30.0, dwell_time=0.5)
    expected = model.scaling.scale_channels(channels(times, depths, edge_from_counts(module.COUNTS, 1)))
    np.testing.assert_allclose(scaled.numpy()[:1], expected, rtol=0.0, atol=1e-5)
    np.testing.assert_array_equal(tabor.numpy()[:1], model.scaling.scale_tabor(np.array([2.0])))


def test_the_measured_curve_on_tissue():
    """It is fitted, agrees with what its authors find, and is not said to be described."""
    curve = ForceCurve.read(EXAMPLES / "measured_tissue.csv", stiffness=0.010951, force_sign="compression")
    assert len(curve) == 800
    # nanite, by the authors of the curve: Hertz on the approach gives 57.6 Pa.
    start = guess_setup(curve, radius=18.64e-6)
    hertz = fit(curve, start, model="hertz", segment="approach")
    apparent = hertz.values["relaxed_modulus"]
    assert apparent == pytest.approx(57.6, rel=0.1)
    result = fit(curve, start, accuracy="draft")
    summary = result.summary()
    assert "contact: viscoelastic sphere with adhesion" in summary
    assert "No model is adequate" in summary
    relaxed = result.values["relaxed_modulus"]
    assert relaxed < apparent < relaxed / result.values["modulus_ratio"]
    assert 5e-7 < result.values["work_of_adhesion"] < 1e-5
    # The largest force is met to a few per cent.
    assert result.curve.force.max() == pytest.approx(curve.force.max(), rel=0.05)


def test_curve_names_source_and_licence():
    assert "afmformats" in (EXAMPLES / "measured_tissue.csv").read_text(encoding="utf-8")
    assert "MIT License" in (EXAMPLES / "measured_tissue.LICENSE").read_text(encoding="utf-8")
