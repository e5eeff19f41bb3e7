"""Files of a laboratory become curves in SI; what cannot be read is one sentence."""

import dataclasses

import numpy as np
import pytest

from bem.lab import ForceCurve
from tests.bem.lab.measurement import closed_form, write_map

pytestmark = pytest.mark.filterwarnings("error")
FORCE = "tension (N)"
ROW = "time (s),indentation (m),force (N)\n0,0,0\n"
CURVE = dataclasses.replace(closed_form("jkr", 3)[0], stage=None)


def written(path, columns, delimiter=","):
    header = delimiter.join(columns)
    np.savetxt(path, np.column_stack([*columns.values()]), delimiter=delimiter, header=header, comments="", fmt="%.12g")
    return path


@pytest.mark.parametrize(
    "titles",
    [
        ("time (s)", "indentation (um)", "tension (mN)"),
        ("t [s]", "depth [um]", "Tension [mN]"),
        ("time_s", "indentation_um", "tension_mN"),
    ],
)
def test_columns_name_their_units(tmp_path, titles):
    values = CURVE.time, 1e6 * CURVE.indentation, 1e3 * CURVE.force
    found = ForceCurve.read(written(tmp_path / "a.csv", dict(zip(titles, values, strict=True))))
    for name in ("time", "indentation", "force"):
        np.testing.assert_allclose(getattr(found, name), getattr(CURVE, name), rtol=1e-9, atol=1e-18)


@pytest.mark.parametrize(
    "lines", ["# a note\n# another, with a comma\n{header}\n", "# a note\n# {header}\n", "{header}\n# a note\n"]
)
def test_comments_are_left_out_and_a_header_may_be_one(tmp_path, lines):
    CURVE.write(tmp_path / "a.csv")
    header, rows = (tmp_path / "a.csv").read_text().split("\n", 1)
    (tmp_path / "b.csv").write_text(lines.format(header=header) + rows)
    np.testing.assert_array_equal(ForceCurve.read(tmp_path / "b.csv").force, ForceCurve.read(tmp_path / "a.csv").force)


def test_the_sign_is_the_readers_choice_and_the_wrong_one_is_refused(tmp_path):
    columns = {"time (s)": CURVE.time, "indentation (m)": CURVE.indentation, FORCE: -CURVE.force}
    path = written(tmp_path / "a.csv", columns)
    np.testing.assert_allclose(ForceCurve.read(path, force_sign="compression").tension, CURVE.force, rtol=1e-9)
    with pytest.raises(ValueError, match=r"grows with depth, which no contact does.*and should be 'compression'"):
        ForceCurve.read(path)
    # A soft cantilever: the indentation follows from the force, the displacement does not.
    with pytest.raises(ValueError, match="should be 'compression'"):
        ForceCurve.read("examples/measured_tissue.csv", stiffness=0.010951, force_sign="tension")


def test_displacement_of_the_stage_loses_what_the_spring_takes(tmp_path):
    stage = CURVE.indentation - CURVE.force / 40.0  # tension pulls the sphere towards the sample, beyond the stage
    for title, place, stiffness in (("displacement (m)", stage, "40 N/m"), ("height (m)", -stage, 40.0)):
        path = written(tmp_path / "a.csv", {"time (s)": CURVE.time, title: place, FORCE: CURVE.force})
        np.testing.assert_allclose(
            ForceCurve.read(path, stiffness=stiffness).indentation, CURVE.indentation, atol=1e-15
        )
        with pytest.raises(ValueError, match=r"the spring constant .* must be given"):
            ForceCurve.read(path)


def test_approach_and_retract_may_be_two_files_and_time_may_be_a_speed(tmp_path):
    half = int(np.argmax(CURVE.indentation)) + 1
    columns = {"time (s)": CURVE.time, "indentation (m)": CURVE.indentation, FORCE: CURVE.force}
    one = written(tmp_path / "1.csv", {title: values[:half] for title, values in columns.items()}, ";")
    late = columns | {"time (s)": CURVE.time - CURVE.time[half]}
    two = written(tmp_path / "2.csv", {title: values[half:] for title, values in late.items()}, ";")
    np.testing.assert_allclose(ForceCurve.read([one, two]).time, CURVE.time, atol=1e-9)
    del columns["time (s)"]
    path = written(tmp_path / "3.csv", columns)
    travelled = np.sum(np.abs(np.diff(CURVE.indentation)))
    assert ForceCurve.read(path, speed=2e-6).time[-1] == pytest.approx(travelled / 2e-6, rel=1e-6)
    for files, options, message in (
        (path, {}, "must have a column time"),
        ([], {}, "path must name at least one file; received none"),
        ([path, tmp_path / "." / "3.csv"], {}, "the files of one curve must be different"),
        (one, {"number": 3}, "from 0 to 0; received 3"),
        ([one, path], {}, r"the same columns; received .*3\.csv with force, indentation"),
    ):
        with pytest.raises(ValueError, match=message):
            ForceCurve.read(files, **options)


def test_columns_of_other_names_are_told_apart(tmp_path):
    path = written(tmp_path / "a.csv", {"clock": CURVE.time, "h": CURVE.indentation, "F_n (N)": CURVE.force})
    names = {"clock": "time (s)", "h": "indentation (m)", "F_n (N)": FORCE}
    assert len(ForceCurve.read(path, columns=names)) == len(CURVE)
    wanted = r"must have a column force, such as 'force \(nN\)'; received .* with no column of a known name"
    with pytest.raises(ValueError, match=wanted):
        ForceCurve.read(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time (s),indentation (m)\n0,0\n1,1\n2,2\n", "a force curve must have a column force"),
        ("Zeit (s),depth (m),Kraft (N)\n0,0,0\n1,1,1\n", r"with \['Zeit \(s\)', 'depth \(m\)', 'Kraft \(N\)'\]"),
        ("0,1,2\n1,2,3\n2,3,4\n", r"with no column of a known name: \["),
        ("time (s),indentation (m),force\n0,0,0\n1,1,1\n", r"a column must name its unit.*received .*'force'"),
        ("time (s),indentation (m),force (um)\n0,0,0\n1,1,1\n", r"column 'force \(um\)' of .* must be a force"),
        (f"{ROW}1,one,1\n", r"a row must hold numbers; received 'one' in column 2 of row 2"),
        (f"{ROW}1,1\n", "at least two rows of numbers"),
        (ROW, "at least two rows"),
        ("time (s),depth (m),indentation (m),force (N)\n0,0,0,0\n1,1,1,1\n", "must have one column indentation"),
        (f"{ROW}1,0,1\n", "a force curve must move; received .*, whose path stays at 0 m"),
        (f"{ROW}2,1,1\n1,2,2\n", "time must not decrease"),
        (b"\xff\xfe\x00\x01", "header and at least two rows"),
        (b"time (s),force (N)\n\x00\x00", "text in UTF-8, UTF-16 or Latin-1"),
    ],
)
def test_a_file_that_is_no_curve_is_one_sentence(tmp_path, text, message):
    (tmp_path / "a.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ValueError, match=message) as error:
        ForceCurve.read(tmp_path / "a.csv")
    assert "\n" not in str(error.value)


def test_a_file_that_is_not_there_or_no_file(tmp_path):
    for name in ("none.csv", "none.jpk-force"):
        with pytest.raises(FileNotFoundError):
            ForceCurve.read(tmp_path / name)
    (tmp_path / "folder.csv").mkdir()
    for folder in (tmp_path / "folder.csv", tmp_path):
        with pytest.raises(ValueError, match=f"{folder}, which is a directory"):
            ForceCurve.read(folder)
    (tmp_path / "device.csv").symlink_to("/dev/null")  # or /dev/zero, which never ends
    for device in (tmp_path / "device.csv", "/dev/null"):
        with pytest.raises(ValueError, match=f"received {device}.*not a regular file"):
            ForceCurve.read(device)
    for path in (None, 3, [3]):
        with pytest.raises(ValueError, match=r"path must be one of str.*received"):
            ForceCurve.read(path)


def test_an_afm_file_is_read_through_afmformats(tmp_path):
    pytest.importorskip("afmformats")
    write_map(tmp_path / "a.h5", [dataclasses.replace(CURVE, stage=CURVE.indentation - CURVE.force / 40.0)])
    found = ForceCurve.read(tmp_path / "a.h5")
    np.testing.assert_allclose(found.indentation, CURVE.indentation, atol=1e-12)
    np.testing.assert_allclose(found.tension, CURVE.force, rtol=1e-6)
    # Its reader takes no spring constant; the force follows from the same deflection.
    stiffer = ForceCurve.read(tmp_path / "a.h5", stiffness=80.0)
    np.testing.assert_allclose(stiffer.tension, 2.0 * found.tension)
    np.testing.assert_allclose(stiffer.indentation, found.indentation)
    (tmp_path / "b.h5").write_bytes(b"nothing")
    with pytest.raises(ValueError, match="a measured curve must be a CSV or an AFM file that afmformats reads"):
        ForceCurve.read(tmp_path / "b.h5")


def test_volts_become_forces_by_the_sensitivity(tmp_path):
    pytest.importorskip("afmformats")
    height, volts = np.linspace(0.0, 1000.0, 50), np.linspace(2.0, 0.0, 50)
    np.savetxt(tmp_path / "a.txt", np.column_stack([height, volts, volts]), delimiter="\t")
    given = {"speed": 1e-6, "stiffness": "0.1 N/m", "force_sign": "compression"}
    needed = r"no column of a known name.*as a file of an instrument: the AFM file must .*--sensitivity.*Please specify"
    with pytest.raises(ValueError, match=needed):
        ForceCurve.read(tmp_path / "a.txt", **given)
    found = ForceCurve.read(tmp_path / "a.txt", sensitivity="50 nm/V", **given)
    assert np.ptp(found.force) == pytest.approx(2.0 * 1e-9 * 50e-9 * 0.1, rel=0.1)
    (tmp_path / "b.csv").write_text(f"{ROW}1,1,1\n")
    with pytest.raises(
        ValueError, match=r"sensitivity turns volts into a force; received .*b\.csv, which has no volts"
    ):
        ForceCurve.read(tmp_path / "b.csv", sensitivity=1.0)
