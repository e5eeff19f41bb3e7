"""Broad-band solids: their series, and how pulling fast amplifies the pull-off force."""

import numpy as np
import pytest

from bem import StandardLinearSolid
from experiments.robustness import broad_band


@pytest.mark.parametrize("n", broad_band.EXPONENTS)
def test_series_stands_for_the_power_law(n):
    material, error = broad_band.prony_fit(n)
    assert error < 1e-3
    assert material.modulus_ratio == pytest.approx(0.1, rel=1e-9)
    times = np.array([0.0, 0.5, 5.0, 50.0])
    np.testing.assert_allclose(material.creep_compliance(times), broad_band.power_law(n, times), atol=1e-3)


def test_amplification_grows_from_one_towards_the_modulus_ratio():
    material = StandardLinearSolid(broad_band.RATIO)
    slow, fast = (broad_band.pulled(material, 10.0, rate, "draft")["amplification"] for rate in (1e-3, 1e5))
    assert slow == pytest.approx(1.05, abs=0.05)
    assert 6.0 < fast < 10.0


def test_each_curve_has_the_points_of_its_own_preload(monkeypatch):
    def pulled(_, preload, rate, __):
        return {"unloading_rate": rate, "amplification": preload, "status": "completed", "seconds": 0.0}

    monkeypatch.setattr(broad_band, "pulled", pulled)
    curves = broad_band.study(rates=3, accuracy="draft", jobs=1)["curves"]
    assert len(curves) == 5 * len(broad_band.PRELOADS)
    assert all([point["amplification"] for point in one["points"]] == [one["preload"]] * 3 for one in curves)


def test_amplification_is_also_over_the_elastic_solid_of_the_same_range(monkeypatch):
    monkeypatch.setattr(broad_band, "EXPONENTS", (1.6,))
    monkeypatch.setattr(broad_band, "PRELOADS", (10.0,))
    content = broad_band.study(rates=3, accuracy="draft", jobs=1)
    assert [curve["terms"] for curve in content["curves"]] == [7, 1]
    (point, *_), _ = (curve["points"] for curve in content["curves"])
    assert (point["unloading_rate"], point["status"]) == (1e-6, "completed")
    ratio = point["amplification"] / point["own_amplification"]
    assert ratio == pytest.approx(content["elastic_pull_off"] / 1.5, rel=1e-4)
    assert 1.0 < ratio < 1.1
