"""Files of a laboratory become curves in SI; what cannot be read is one sentence."""

import dataclasses

import numpy as np
import pytest

from bem.lab import ForceCurve
from bem.lab.contact_point import noise_of
from experiments.robustness.lab_curves import write_map
from tests.bem.lab.measurement import BEAD, TRUTH, measured

pytestmark = pytest.mark.filterwarnings("error")


@pytest.fixture(scope="module")
def curve():
    return measured()


def written(path, header, *columns, delimiter=","):
    np.savetxt(path, np.column_stack(columns), delimiter=delimiter, header=header, comments="", fmt="%.12g")
    return path


@pytest.mark.parametrize(
    "header", ["time (s),indentation (um),force (mN)", "t [s],depth [um],load [mN]", "time_s,indentation_um,force_mN"]
)
def test_columns_name_their_units(tmp_path, curve, header):
    path = written(tmp_path / "a.csv", header, curve.time, 1e6 * curve.indentation, 1e3 * curve.force)
    found = ForceCurve.read(path)
    for name in ("time", "indentation", "force"):
        np.testing.assert_allclose(getattr(found, name), getattr(curve, name), rtol=1e-9, atol=1e-18)


@pytest.mark.parametrize(
    "lines", ["# a note\n# another, with a comma\n{header}\n", "# a note\n# {header}\n", "{header}\n# a note\n"]
)
def test_comments_are_left_out_and_a_header_may_be_one(tmp_path, curve, lines):
    curve.write(tmp_path / "a.csv")
    header, rows = (tmp_path / "a.csv").read_text().split("\n", 1)
    (tmp_path / "b.csv").write_text(lines.format(header=header) + rows)
    np.testing.assert_array_equal(ForceCurve.read(tmp_path / "b.csv").force, ForceCurve.read(tmp_path / "a.csv").force)


def test_the_sign_is_the_readers_choice_and_the_wrong_one_is_refused(tmp_path, curve):
    path = written(
        tmp_path / "a.csv", "time (s),indentation (m),force (N)", curve.time, curve.indentation, -curve.force
    )
    found = ForceCurve.read(path, force_sign="compression")
    np.testing.assert_allclose(found.tension, curve.force, rtol=1e-9)
    with pytest.raises(ValueError, match=r"grows with depth, which no contact does.*and should be 'compression'"):
        ForceCurve.read(path)


def test_displacement_of_the_stage_loses_what_the_spring_takes(tmp_path, curve):
    stiffness = 40.0
    stage = curve.indentation - curve.force / stiffness  # tension pulls the sphere towards the sample, beyond the stage
    path = written(tmp_path / "a.csv", "time (s),displacement (m),force (N)", curve.time, stage, curve.force)
    np.testing.assert_allclose(ForceCurve.read(path, stiffness="40 N/m").indentation, curve.indentation, atol=1e-15)
    with pytest.raises(ValueError, match="Expected the stiffness"):
        ForceCurve.read(path)
    away = written(tmp_path / "b.csv", "time (s),height (m),force (N)", curve.time, -stage, curve.force)
    np.testing.assert_allclose(ForceCurve.read(away, stiffness=40.0).indentation, curve.indentation, atol=1e-15)


def test_approach_and_retract_may_be_two_files_and_time_may_be_a_speed(tmp_path, curve):
    half = int(np.argmax(curve.indentation)) + 1
    header = "time (s);indentation (m);force (N)"
    one = written(
        tmp_path / "1.csv", header, *(c[:half] for c in (curve.time, curve.indentation, curve.force)), delimiter=";"
    )
    late = curve.time[half:] - curve.time[half]
    two = written(tmp_path / "2.csv", header, late, curve.indentation[half:], curve.force[half:], delimiter=";")
    np.testing.assert_allclose(ForceCurve.read([one, two]).time, curve.time, atol=1e-9)
    moving = np.append(True, np.diff(curve.indentation) != 0.0)
    path = written(tmp_path / "3.csv", "indentation (m),force (N)", curve.indentation[moving], curve.force[moving])
    found = ForceCurve.read(path, speed=2e-6)
    assert found.time[-1] == pytest.approx(np.sum(np.abs(np.diff(curve.indentation))) / 2e-6, rel=1e-6)
    with pytest.raises(ValueError, match="Expected a column time"):
        ForceCurve.read(path)
    with pytest.raises(ValueError, match="the files of one curve must be different"):
        ForceCurve.read([path, tmp_path / "." / "3.csv"])
    with pytest.raises(ValueError, match="from 0 to 0; received 3"):
        ForceCurve.read(one, number=3)
    with pytest.raises(ValueError, match=r"the same columns; received .*3\.csv with force, indentation"):
        ForceCurve.read([one, path])


def test_columns_of_other_names_are_told_apart(tmp_path, curve):
    path = written(tmp_path / "a.csv", "clock,h,F_n (N)", curve.time, curve.indentation, curve.force)
    names = {"clock": "time (s)", "h": "indentation (m)", "F_n (N)": "force (N)"}
    assert len(ForceCurve.read(path, columns=names)) == len(curve)
    wanted = r"Expected a column force, such as 'force \(nN\)'; received .* with no column of a known name"
    with pytest.raises(ValueError, match=wanted):
        ForceCurve.read(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time (s),indentation (m)\n0,0\n1,1\n2,2\n", "Expected a column force"),
        ("0,1,2\n1,2,3\n2,3,4\n", "with no column of a known name in its first line"),
        ("time (s),indentation (m),force\n0,0,0\n1,1,1\n", r"a column must name its unit.*received 'force'"),
        ("time (s),indentation (m),force (um)\n0,0,0\n1,1,1\n", r"column 'force \(um\)' of .* must be a force"),
        (
            "time (s),indentation (m),force (N)\n0,0,0\n1,one,1\n",
            r"Expected finite numbers in column.*received 'one' in row 2",
        ),
        ("time (s),indentation (m),force (N)\n0,0,0\n1,1\n", "received nothing in row 2"),
        ("time (s),indentation (m),force (N)\n0,0,0\n1,nan,1\n", "Expected finite numbers"),
        ("time (s),indentation (m),force (N)\n0,0,0\n", "Expected a header and at least two rows"),
        ("time (s),depth (m),indentation (m),force (N)\n0,0,0,0\n1,1,1,1\n", "Expected one column indentation"),
        ("time (s),indentation (m),force (N)\n1,0,0\n0,1,1\n", "time must not decrease"),
    ],
)
def test_a_file_that_is_no_curve_is_one_sentence(tmp_path, text, message):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(ValueError, match=message) as error:
        ForceCurve.read(tmp_path / "a.csv")
    assert "\n" not in str(error.value)


def test_a_file_that_is_not_there_or_no_text(tmp_path):
    with pytest.raises(FileNotFoundError):
        ForceCurve.read(tmp_path / "none.csv")
    with pytest.raises(FileNotFoundError):
        ForceCurve.read(tmp_path / "none.jpk-force")
    (tmp_path / "a.csv").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(ValueError, match="not UTF-8 text"):
        ForceCurve.read(tmp_path / "a.csv")
    (tmp_path / "folder.csv").mkdir()
    for folder in (tmp_path / "folder.csv", tmp_path):
        with pytest.raises(ValueError, match=f"{folder}, which is a directory"):
            ForceCurve.read(folder)


def test_an_afm_file_is_read_through_afmformats(tmp_path, curve):
    pytest.importorskip("afmformats")
    write_map(tmp_path / "a.h5", [dataclasses.replace(curve, stage=curve.indentation - curve.force / 40.0)])
    found = ForceCurve.read(tmp_path / "a.h5")
    np.testing.assert_allclose(found.indentation, curve.indentation, atol=1e-12)
    np.testing.assert_allclose(found.tension, curve.force, rtol=1e-6)
    (tmp_path / "b.h5").write_bytes(b"nothing")
    with pytest.raises(ValueError, match="Expected a CSV or an AFM file that afmformats reads"):
        ForceCurve.read(tmp_path / "b.h5")


def test_baseline_noise_and_contact_point_are_found(curve):
    contact = curve.contact()
    noise = 0.01 * np.ptp(measured(noise=0.0).force)
    assert contact.force_offset == pytest.approx(TRUTH["force_offset"], abs=noise)
    assert contact.noise == pytest.approx(noise, rel=0.3)
    assert noise_of(curve.force) == pytest.approx(noise, rel=0.3)
    # Attraction begins up to the default start before the undeformed sphere would touch.
    assert -(np.pi ** (2 / 3)) * BEAD.adhesion_length < contact.contact_point - TRUTH["contact_point"] < 0.0
    shifted = curve.shifted(contact_point=contact.contact_point, force_offset=contact.force_offset).contact()
    assert shifted.contact_point == pytest.approx(0.0, abs=1e-15)


def test_a_curve_without_contact_or_baseline_is_refused(curve):
    rng = np.random.default_rng(0)
    flat = ForceCurve(time=curve.time, indentation=curve.indentation, force=1e-9 * rng.standard_normal(len(curve)))
    with pytest.raises(ValueError, match="the curve shows no contact"):
        flat.contact()
    late = slice(70, None)
    inside = ForceCurve(time=curve.time[late], indentation=curve.indentation[late], force=curve.force[late])
    with pytest.raises(ValueError, match="must begin with at least 10 points before contact"):
        inside.contact()
    short = ForceCurve(time=curve.time[-30:], indentation=curve.indentation[-30:], force=curve.force[-30:])
    with pytest.raises(ValueError, match="at least 20 points up to its deepest one"):
        short.contact()


@pytest.mark.parametrize("path", [None, 3, [3]])
def test_what_is_no_path_is_refused(path):
    with pytest.raises(ValueError, match=r"path must be one of str.*received"):
        ForceCurve.read(path)
