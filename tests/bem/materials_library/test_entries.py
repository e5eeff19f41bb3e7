"""Each material of the library says where it is from, where it holds and how far to trust it."""

import numpy as np
import pytest

from bem import Elastic, PronySeries
from bem.lab import Setup
from bem.materials_library import load, names, relaxation_spectrum
from bem.materials_library.entries import TEXTS

OWN = """
title = "A gel"
source = "This laboratory"
conditions = "25 C"
validity = "1 mHz to 10 Hz"
caution = "One batch"
relaxed_modulus = 1e4
poisson_ratio = 0.49
[prony]
relaxation_moduli = [2e4, 1e4]
relaxation_times = [0.1, 10.0]
[wlf]
reference = 25.0
c1 = 8.0
c2 = 100.0
"""


@pytest.mark.parametrize("name", names())
def test_every_entry_has_a_source_its_conditions_and_a_caution(name):
    entry = load(name)
    assert all(len(getattr(entry, text)) > 20 for text in TEXTS)
    assert "doi" in entry.notes
    low, high = entry.relaxed_modulus_interval
    assert low < entry.relaxed_modulus < high
    assert "range over" in entry.caution  # the literature's moduli differ by decades
    setup = Setup(radius=50e-6, work_of_adhesion=0.05, relaxed_modulus=entry.relaxed_modulus, material=entry.material)
    assert setup.tabor > 0.0


def test_a_file_of_ones_own_is_read_and_shifted(tmp_path):
    (tmp_path / "gel.toml").write_text(OWN)
    entry = load(tmp_path / "gel.toml")
    assert isinstance(entry.material, PronySeries)
    moduli, times = relaxation_spectrum(entry.material)
    np.testing.assert_allclose(moduli * entry.relaxed_modulus, [2e4, 1e4])
    np.testing.assert_allclose(times, [0.1, 10.0])
    np.testing.assert_allclose(entry.at(25.0).times, entry.material.times)
    np.testing.assert_allclose(entry.at(50.0).times, entry.material.times * 10 ** (-8 * 25 / 125))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("caution", "warning"), "Expected caution in"),
        (("relaxed_modulus = 1e4", "relaxed_modulus = -1.0"), "relaxed_modulus must be a finite number greater than 0"),
        (("relaxation_times", "times"), "Expected relaxation_moduli and relaxation_times of prony"),
        (("title", "colour = 'red'\ntitle"), r"received \['colour'\]"),
        (("[wlf]", "[wlf"), "Expected a TOML file of a material"),
    ],
)
def test_a_file_that_is_no_material_is_one_sentence(tmp_path, change, message):
    (tmp_path / "gel.toml").write_text(OWN.replace(*change))
    with pytest.raises(ValueError, match=message):
        load(tmp_path / "gel.toml")


def test_unknown_names_and_missing_constants():
    with pytest.raises(ValueError, match=r"material must be one of .*, or a .toml file; received 'rubber'"):
        load("rubber")
    with pytest.raises(FileNotFoundError):
        load("none.toml")
    entry = load(names()[0])
    assert entry.material == Elastic()
    with pytest.raises(ValueError, match=r"has no WLF constants; received a temperature of 30.0"):
        entry.at(30.0)
