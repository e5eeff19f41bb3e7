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
def test_entries_have_source_and_caution(name):
    entry = load(name)
    assert [text for text in TEXTS if len(getattr(entry, text)) <= 20] == []
    assert "doi" in entry.notes
    low, high = entry.relaxed_modulus_interval or (0.0, np.inf)
    assert low < entry.relaxed_modulus < high
    assert "range over" in entry.caution  # the literature's moduli differ by decades
    setup = Setup(radius=50e-6, work_of_adhesion=0.05, relaxed_modulus=entry.relaxed_modulus, material=entry.material)
    assert setup.tabor > 0.0


def test_laminated_glass_has_table_moduli():
    """3 s, 1 min and 1 h at 20 C: 8.06, 1.64 and 0.84 MPa are the values that designers of glass know."""
    entry = load("pvb_laminated_glass_at_20c")
    moduli, times = relaxation_spectrum(entry.material)
    instants = np.array([3.0, 60.0, 3600.0])
    relaxed = 1.0 + np.exp(-instants[:, np.newaxis] / times) @ moduli
    np.testing.assert_allclose(entry.relaxed_modulus / 3.0 * relaxed, [8.06e6, 1.64e6, 0.84e6], rtol=0.02)
    assert entry.relaxed_modulus / entry.material.modulus_ratio == pytest.approx(3 * 471e6, rel=1e-4)
    # One degree warmer it relaxes by WLF's 20.7 / 92.1 of a decade earlier.
    np.testing.assert_allclose(entry.at(21.0).times, entry.material.times * 10 ** (-20.7 / 92.1))


def test_polyurea_is_as_stiff_as_its_source():
    entry = load("polyurea_at_0c")
    glassy = 3 * 22.4e6 * (1.0 + 0.8458 + 1.686 + 3.594 + 4.342)
    assert entry.relaxed_modulus / entry.material.modulus_ratio == pytest.approx(glassy, rel=1e-5)
    np.testing.assert_allclose(relaxation_spectrum(entry.material)[1], [7.321e-10, 1.163e-7, 6.407e-5, 0.4634])


def test_users_file_is_read_and_shifted(tmp_path):
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
        (("caution", "warning"), "must have caution"),
        (("relaxed_modulus = 1e4", "relaxed_modulus = -1.0"), "relaxed_modulus must be a finite number greater than 0"),
        (("relaxation_times", "times"), "must have relaxation_moduli and relaxation_times"),
        (("title", "colour = 'red'\ntitle"), r"received \['colour'\]"),
        (("[wlf]", "[wlf"), "a material must be a TOML file"),
        (('"A gel"', "5"), r"title must be text in .*; received 5"),
        (("[prony]", "[[prony]]"), r"prony must be a table in .*; received \[\{"),
        (("[wlf]", "[[wlf]]"), "wlf must be a table in"),
    ],
)
def test_file_without_material_is_refused(tmp_path, change, message):
    (tmp_path / "gel.toml").write_text(OWN.replace(*change))
    with pytest.raises(ValueError, match=message):
        load(tmp_path / "gel.toml")


def test_unknown_names_and_missing_constants():
    with pytest.raises(ValueError, match=r"material must be one of .*, or a .toml file; received 'rubber'"):
        load("rubber")
    with pytest.raises(ValueError, match=r"material must be one of str.*received 3"):
        load(3)
    with pytest.raises(FileNotFoundError):
        load("none.toml")
    entry = load("sylgard_184_cured_at_100c")
    assert entry.material == Elastic()
    with pytest.raises(ValueError, match=r"has no WLF constants; received a temperature of 30.0"):
        entry.at(30.0)
