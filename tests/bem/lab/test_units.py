"""Quantities with units become SI numbers, or one sentence."""

import pytest

from bem.lab.units import readable, to_si

SI = {
    "length": {"50 um": 50e-6, "50um": 50e-6, "1e-2 µm": 1e-8, "3 micrometers": 3e-6, "7 pm": 7e-12, "3e-6": 3e-6},
    "energy per area": dict.fromkeys(("50mJ/m2", "50 mN/m", "50 mJ m⁻²", "50 mJ * m**-2"), 0.05),
    "pressure": {"2MPa": 2e6},
    "speed": {"0.2 um/s": 2e-7},
    "stiffness": {"4 N/m": 4.0, "4 nN/nm": 4.0},
    "time": {"2 min": 120.0},
    "number": {"30 %": 0.3},
}


@pytest.mark.parametrize("dimension", SI)
def test_text_with_a_unit_becomes_si(dimension):
    found = {text: to_si("radius", text, dimension) for text in SI[dimension]}
    assert found == pytest.approx(SI[dimension], rel=1e-12, abs=0.0)


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


def test_numbers_are_written_with_a_prefix():
    numbers = (5.0345e-5, "m"), (2e6, "Pa"), (0.05, "J/m^2"), (0.3, ""), (0.0, "N")
    assert [readable(*number) for number in numbers] == ["50.34 um", "2 MPa", "50 mJ/m^2", "0.3", "0 N"]
