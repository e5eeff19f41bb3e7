import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from surrogate.data.features import channels, edge_from_indentations
from surrogate.data.scaling import Scaling, symexp, symlog


@pytest.fixture(scope="module")
def physical(dataset, grid):
    times, indentations = grid
    return channels(times, indentations, edge_from_indentations(indentations))


@pytest.fixture(scope="module")
def scaling(dataset, physical):
    return Scaling.fit(
        physical,
        tabor=dataset.protocols["tabor"],
        force=dataset.force,
        protocols=dataset.protocols,
        dataset_sha256=dataset.sha256,
    )


def test_symexp_overflows_to_infinity():
    assert symexp(np.array([-800.0, 800.0])).tolist() == [-np.inf, np.inf]


@given(st.floats(-1e6, 1e6))
def test_symexp_inverts_symlog(value):
    np.testing.assert_allclose(symexp(symlog(np.array(value))), value, rtol=1e-13, atol=1e-300)


def test_channels_transform_as_in_the_paper():
    # One point each, where the statistics do nothing: zero mean, unit deviation.
    unit = Scaling("C", channel_mean=(0.0,) * 4, channel_scale=(1.0,) * 4, tabor=(0.0, 1.0), force=(0.0, 1.0))
    log = np.log1p
    point = np.array([[[3.0, -2.0, 5.0, -7.0]]])
    np.testing.assert_allclose(unit.scale_channels(point)[0, 0], [log(log(3.0)), -log(2.0), log(5.0), -log(7.0)])
    edge = replace(unit, features="D").scale_channels(np.array([[[0.0, 0.0, 0.0, 1.0]]]))
    np.testing.assert_array_equal(edge[0, 0], [0.0, 0.0, 0.0, 1.0])
    shifted = replace(unit, tabor=(0.5, 2.0), force=(0.5, 2.0))
    assert shifted.scale_tabor(np.array([4.0]))[0, 0] == pytest.approx((log(4.0) - 0.5) / 2.0)
    assert shifted.scale_force(np.array(-4.0)) == pytest.approx((-log(4.0) - 0.5) / 2.0)


def test_scaled_training_set_is_standard(scaling, physical, dataset):
    scaled = scaling.scale_channels(physical).astype(float)
    np.testing.assert_allclose(scaled.mean(axis=(0, 1)), 0.0, atol=1e-5)
    np.testing.assert_allclose(scaled.std(axis=(0, 1)), 1.0, atol=1e-5)
    assert scaling.scale_tabor(dataset.protocols["tabor"]).shape == (len(dataset), 1)
    forces = scaling.scale_force(dataset.force)
    assert forces.std() == pytest.approx(1.0)
    np.testing.assert_allclose(scaling.unscale_force(forces), dataset.force, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(scaling.scale_channels(physical[3]), scaling.scale_channels(physical)[3])


def test_constant_channel_becomes_zero(physical):
    constant = physical.copy()
    constant[..., 3] = 0.0
    scaling = Scaling.fit(constant, tabor=np.ones(len(constant)), force=constant[..., 0])
    assert np.all(scaling.scale_channels(constant)[..., 3] == 0.0)
    assert scaling.channel_scale[3] == scaling.tabor[1] == 1.0
    np.testing.assert_allclose(scaling.scale_tabor(np.ones(2)), 0.0, atol=1e-12)


def test_file_round_trip_is_exact(scaling, tmp_path):
    scaling.save(tmp_path / "scaling.json")
    assert Scaling.load(tmp_path / "scaling.json") == scaling


def test_bad_files_and_channels(scaling, physical, tmp_path):
    path, good = tmp_path / "scaling.json", json.loads(scaling.to_json())
    for content in ({}, 5, good | {"features": ["D"]}, good | {"force": "ab"}, good | {"ranges": {"tabor": [1]}}):
        path.write_text(json.dumps(content))
        with pytest.raises(ValueError, match="; received "):
            Scaling.load(path)
    path.write_text(json.dumps(good | {"features": "A"}))
    with pytest.raises(ValueError, match="moments of other channels"):
        Scaling.load(path)
    with pytest.raises(ValueError, match="channels must be 4"):
        scaling.scale_channels(physical[..., :3])
