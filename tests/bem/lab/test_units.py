"""Quantities with units become SI numbers, or one sentence."""

import pytest

from bem.lab.units import readable, to_si


@pytest.mark.parametrize(
    ("text", "dimension", "expected"),
    [
        ("50 um", "length", 50e-6),
        ("50um", "length", 50e-6),
        ("1e-2 µm", "length", 1e-8),
        ("300 nm", "length", 3e-7),
        ("50mJ/m2", "energy per area", 0.05),
        ("50 mN/m", "energy per area", 0.05),
        ("2MPa", "pressure", 2e6),
        ("0.2 um/s", "speed", 2e-7),
        ("3e-6", "length", 3e-6),
        ("4 N/m", "stiffness", 4.0),
        ("4 nN/nm", "stiffness", 4.0),
        ("50 mJ m⁻²", "energy per area", 0.05),
        ("50 mJ * m**-2", "energy per area", 0.05),
        ("3 micrometers", "length", 3e-6),
        ("2 min", "time", 120.0),
        ("30 %", "number", 0.3),
    ],
)
def test_text_with_a_unit_becomes_si(text, dimension, expected):
    assert to_si("radius", text, dimension) == pytest.approx(expected, rel=1e-12)


def test_a_quantity_of_pint_is_understood_whatever_its_registry():
    pint = pytest.importorskip("pint")
    quantity = pint.UnitRegistry(cache_folder=None).Quantity
    assert to_si("radius", quantity(50.0, "um"), "length") == pytest.approx(50e-6)
    with pytest.raises(ValueError, match=r"^radius must be a length, such as '50 um'; received '50.0 newton'"):
        to_si("radius", quantity(50.0, "N"), "length")


@pytest.mark.parametrize(
    "wrong",
    [
        *("50 mN", "many", "50 blub", None, True, [1.0], "5 m m m", "um", "5 m/", "5 kmin", "1 10**10**10*m"),
        *("5 __import__('os')", "5 m^99", "1 Tm9*Tm9*Tm9/Tm/fm9/fm9/fm8", "5 " + "m" * 10**6, "1" * 10**6 + "\nm"),
    ],
)
def test_a_unit_that_does_not_fit_is_one_sentence(wrong):
    with pytest.raises(ValueError, match=r"^radius must be a length") as error:
        to_si("radius", wrong, "length")
    assert "\n" not in str(error.value)
    assert "received" in str(error.value)
    assert len(str(error.value)) < 500


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (5.0345e-5, "m", "50.34 um"),
        (2e6, "Pa", "2 MPa"),
        (0.05, "J/m^2", "50 mJ/m^2"),
        (0.3, "", "0.3"),
        (0.0, "N", "0 N"),
    ],
)
def test_numbers_are_written_with_a_prefix(value, unit, text):
    assert readable(value, unit) == text
