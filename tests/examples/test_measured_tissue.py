"""The published curve is fitted, agrees with what its authors find, and is not said to be described."""

import pytest

from tests.examples.test_examples import EXAMPLES, example


def test_measured_tissue(tmp_path, monkeypatch, capsys):
    module = example("measured_tissue")
    curve = module.read()
    assert len(curve) == 800
    assert curve.stiffness == pytest.approx(module.STIFFNESS, rel=1e-3)
    # nanite, by the authors of the curve: Hertz on the approach gives 57.6 Pa.
    hertz = module.apparent_modulus(curve)
    apparent = hertz.values["relaxed_modulus"]
    low, high = hertz.intervals["relaxed_modulus"]
    assert apparent == pytest.approx(57.6, rel=0.1)
    assert low < 57.6 * 0.95 < high * 1.1
    result = module.fitted(curve, "draft")
    monkeypatch.setattr(module, "fitted", lambda _: result)
    module.main(tmp_path / "tissue.png")
    assert (tmp_path / "tissue.png").stat().st_size > 10_000
    said = capsys.readouterr().out
    assert "solver: viscoelastic sphere with adhesion" in said
    assert "No model is adequate" in said
    assert "over windows of depth" in said
    assert (
        result.values["relaxed_modulus"] < apparent < result.values["relaxed_modulus"] / result.values["modulus_ratio"]
    )
    assert 5e-7 < result.values["work_of_adhesion"] < 1e-5
    # The largest force is met to a few per cent.
    assert result.curve.force.max() == pytest.approx(curve.force.max(), rel=0.05)


def test_the_curve_names_its_source_and_its_licence():
    assert "afmformats" in (EXAMPLES / "measured_tissue.csv").read_text(encoding="utf-8")
    assert "MIT License" in (EXAMPLES / "measured_tissue.LICENSE").read_text(encoding="utf-8")
