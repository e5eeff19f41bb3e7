"""Files as instruments write them, made here with numbers of our own, are read with the right values."""

import numpy as np
import pytest

from bem.lab import ForceCurve
from bem.lab.exporters import EXPORTERS

HALF, STIFFNESS, RADIUS, REDUCED = 60, 0.5, 10e-6, 4000.0
DEPTH = 1e-6 * np.concatenate([np.linspace(-2.0, 1.0, HALF), np.linspace(1.0, -2.0, HALF)])
FORCE = 4 / 3 * REDUCED * np.sqrt(RADIUS) * np.maximum(DEPTH, 0.0) ** 1.5
STAGE, TIME = DEPTH + FORCE / STIFFNESS, np.linspace(0.0, 2.0, 2 * HALF)


def rows(columns, separator="\t", comma=False):
    text = "\n".join(separator.join(f"{value:.9g}" for value in row) for row in np.column_stack(columns))
    return text.replace(".", ",") if comma else text


def optics11():
    """Piuma: piezo grows towards the sample, indentation is without deflection."""
    head = "Date\t01/02/2026\nTip radius (um)\t10\nk (N/m)\t0.5\n\n"
    titles = "Time (s)\tLoad (uN)\tIndentation (nm)\tCantilever (nm)\tPiezo (nm)\tAuxiliary\n"
    columns = TIME, 1e6 * FORCE, 1e9 * DEPTH, 1e9 * FORCE / STIFFNESS, 1e9 * STAGE, 0.0 * TIME
    return (head + titles + rows(columns)).encode("latin-1"), {}


def jpk():
    """Two segments, each with its header; height counts away from the sample."""
    head = "# springConstant: 0.5\n# columns: height vDeflection seriesTime\n# units: m N s\n# segment: {}\n"
    parts = [rows([-STAGE[part], FORCE[part], TIME[part]], " ") for part in (slice(0, HALF), slice(HALF, None))]
    return (head.format("extend") + parts[0] + "\n\n" + head.format("retract") + parts[1]).encode(), {}


def bruker():
    """Paired columns; the retraction is stored from the far end on."""
    titles = "Calc_Ramp_Ex_nm\tCalc_Ramp_Rt_nm\tDefl_pN_Ex\tDefl_pN_Rt\n".replace("Defl_pN", "Force_pN")
    stage, force = 1e9 * STAGE + 3000.0, 1e12 * FORCE
    columns = stage[:HALF], stage[HALF:][::-1], force[:HALF], force[HALF:][::-1]
    return (titles + rows(columns)).encode(), {"stiffness": 0.5, "speed": 3e-6}


def bruker_deflection():
    titles = "Height_Sensor_nm_Ex\tHeight_Sensor_nm_Rt\tDefl_nm_Ex\tDefl_nm_Rt\n"
    height, bent = -1e9 * STAGE, 1e9 * FORCE / STIFFNESS
    return (titles + rows([height[:HALF], height[HALF:], bent[:HALF], bent[HALF:]])).encode(), {
        "stiffness": 0.5,
        "speed": 3e-6,
    }


def atomicj():
    titles = "Approach Indentation (um);Approach Force (nN);Withdraw Indentation (um);Withdraw Force (nN)\n"
    depth, force = 1e6 * DEPTH, 1e9 * FORCE
    return (titles + rows([depth[:HALF], force[:HALF], depth[HALF:], force[HALF:]], ";")).encode(), {"speed": 3e-6}


def generic():
    return ("time (s),indentation (um),force (nN)\n" + rows([TIME, 1e6 * DEPTH, 1e9 * FORCE], ",")).encode(), {}


def decimal_commas():
    text = "Time [s];Depth [µm];Load [nN]\n" + rows([TIME, 1e6 * DEPTH, 1e9 * FORCE], ";", comma=True)
    return text.encode("cp1252"), {}


def utf_16():
    return ("time_s\tdepth_um\tforce_nN\n" + rows([TIME, 1e6 * DEPTH, 1e9 * FORCE])).encode("utf-16"), {}


def gaps():
    """Empty and NaN rows, also the last."""
    lines = rows([TIME, 1e6 * DEPTH, 1e9 * FORCE], ",").split("\n")
    lines.insert(5, "nan,nan,nan")
    return ("time (s),indentation (um),force (nN)\n" + "\n".join([*lines, ",,", "NaN,NaN,NaN", ""])).encode(), {}


def backwards():
    """Stored from the last instant on."""
    text = "time (s),height (um),force (nN)\n" + rows([TIME[::-1], -1e6 * STAGE[::-1], 1e9 * FORCE[::-1]], ",")
    return text.encode(), {"stiffness": "0.5 N/m"}


def volts():
    titles = "time (s)\tz (um)\tdeflection (V)\n"
    return (titles + rows([TIME, 1e6 * STAGE, FORCE / STIFFNESS / 50e-9])).encode(), {
        "stiffness": 0.5,
        "sensitivity": "50 nm/V",
    }


LAYOUTS = (
    *(optics11, jpk, bruker, bruker_deflection, atomicj, generic),
    *(decimal_commas, utf_16, gaps, backwards, volts),
)


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.__name__)
def test_layout_is_read(tmp_path, layout):
    content, options = layout()
    (tmp_path / "curve.txt").write_bytes(content)
    curve = ForceCurve.read(tmp_path / "curve.txt", **options)
    assert curve.force_sign == "compression"
    np.testing.assert_allclose(curve.force, FORCE, atol=1e-7 * FORCE.max())
    depth = curve.indentation - curve.indentation[0] + DEPTH[0]
    np.testing.assert_allclose(depth, DEPTH, atol=1e-6 * np.ptp(DEPTH))
    assert np.all(np.diff(curve.time) >= 0.0)
    assert "Force counted as positive in compression." in curve.notes


def test_rows_left_out_are_counted(tmp_path):
    (tmp_path / "a.csv").write_bytes(gaps()[0])
    assert "3 rows without numbers were left out." in ForceCurve.read(tmp_path / "a.csv").notes


@pytest.mark.parametrize("layout", [optics11, jpk])
def test_another_spring_constant_acts(tmp_path, layout):
    """The force was made with that of the file: the deflection stays."""
    (tmp_path / "a.txt").write_bytes(layout()[0])
    curve = ForceCurve.read(tmp_path / "a.txt", stiffness=1.0)
    np.testing.assert_allclose(curve.force, 2.0 * FORCE, atol=1e-7 * FORCE.max())
    assert curve.stiffness == pytest.approx(1.0, rel=1e-6)


def test_a_spring_constant_gives_a_stage(tmp_path):
    (tmp_path / "a.txt").write_bytes(generic()[0])
    curve = ForceCurve.read(tmp_path / "a.txt", stiffness=0.5)
    np.testing.assert_allclose(curve.stage, STAGE, atol=1e-12)


def test_units_of_the_table_are_known():
    from bem.lab.units import factor

    for columns in EXPORTERS.values():
        for quantity, unit in columns.values():
            dimension = {"time": "time", "force": "force", "tension": "force"}.get(quantity, "length")
            assert not unit or factor(quantity, unit, dimension) > 0.0
