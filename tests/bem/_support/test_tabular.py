"""Records that show themselves: in a line, in a notebook, as tables."""

import sys

import numpy as np
import pytest

from bem.lab import ForceCurve
from surrogate.trajectory import predicted_trajectories
from tests.bem.results.test_trajectory import elliptic_loop, trajectory_of

CURVE = ForceCurve(time=[0, 1, 2], indentation=[-1e-9, 5e-9, -2e-9], force=[0.0, -3e-9, 1e-9])


def prediction(**options):
    time = np.linspace(0.0, 2.0, 5)
    kept = {"unloading_from": 2, "model": "M1-concat", "seconds": 0.1} | options
    return predicted_trajectories(time[None], 1.0 - abs(time[None] - 1.0), np.sin(time[None]), **kept)[0]


def test_repr_names_result_not_arrays():
    assert repr(trajectory_of([0, 1], [0, 1], [0, 1])) == "<Trajectory: status completed, records 2>"
    loop = elliptic_loop(60, unloading=np.arange(119) >= 60)
    assert f"pull-off force {loop.pull_off_force:.4g} pi R dgamma" in repr(loop)
    assert repr(CURVE) == (
        "<ForceCurve: points 3, duration 2.00 s, deepest indentation 5.00 nm, pull-off force 1.00 nN, positive tension>"
    )
    assert repr(prediction(extrapolated=[("mu above 3.2",)])).endswith("outside the training mu above 3.2>")


@pytest.mark.parametrize("record", [elliptic_loop(20), CURVE, prediction()], ids=lambda example: type(example).__name__)
def test_notebook_shows_facts_and_a_picture(record):
    text = record._repr_html_()
    assert text.count("<svg") == text.count("</svg>") == 1
    assert "<?xml" not in text
    assert text.count("<td>") == len(record.facts())
    assert all(f"<td>{value.split()[0]}" in text for value in record.facts().values())
    assert "pi R dgamma" not in text
    assert ("<i>h</i><sub>0</sub> π<i>R</i>Δγ</td>" in text) == ("dgamma" in repr(record))


def test_notebook_shows_unstarted_trajectory():
    text = trajectory_of([], [], [], status="a <b> c")._repr_html_()
    assert "a &lt;b&gt; c" in text
    assert "<svg" not in text


@pytest.mark.parametrize("record", [elliptic_loop(20), CURVE, prediction()], ids=lambda example: type(example).__name__)
def test_tables_have_columns_with_units(record, tmp_path):
    table, labelled = record.to_dataframe(), record.to_xarray()
    assert list(table) == list(record.columns())
    for name, (values, unit) in record.columns().items():
        np.testing.assert_array_equal(table[name], values)
        np.testing.assert_array_equal(labelled[name], values)
        assert table.attrs["units"][name] == labelled[name].attrs["units"] == unit
    assert labelled.attrs["pull_off_force"] == pytest.approx(record.pull_off_force, nan_ok=True)
    labelled.to_netcdf(tmp_path / "history.nc", engine="scipy")


def test_prediction_has_no_radius_column():
    assert "contact_radius" not in prediction().to_dataframe()


def test_a_missing_library_is_named(monkeypatch):
    for name, make in {"pandas": CURVE.to_dataframe, "xarray": CURVE.to_xarray}.items():
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(ImportError, match=rf"needs {name}; install it with `pip install"):
            make()
