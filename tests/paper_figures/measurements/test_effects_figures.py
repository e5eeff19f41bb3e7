"""Figures and tables of the effects, their recommendations and broad-band solids, from made-up measurements."""

from paper_figures.measurements import figure_broad_band, figure_effects
from paper_figures.style import drawing
from paper_figures.tables import table_effects, table_recommendations
from tests.paper_figures.results import SPREAD, UNKNOWN, files_in, made, pictures, tables


def test_effects(measured, tmp_path):
    row = {
        "name": "Hertz",
        "tabor": 1.0,
        "unknowns": 20.2,
        "memory_vectors": 0,
        "steps": 100,
        "seconds": SPREAD,
        "seconds_per_step": 2e-5,
        "closed_form": "Hertz",
        "error": None,
        "files": ["hard_contact"],
        "lines_elsewhere": {"march": 7},
    }
    point = {"errors": {"Hertz": 0.3, "rubbery": 0.1}, "estimate": 0.0}
    points = [
        {"rate": 0.1, "recommended": "elastic rubbery, adhesive", **point},
        {"rate": 10.0, "recommended": "viscoelastic, adhesive", **point},
    ]
    ranges = {f"{name}, {kind}": 0.1 for name in ("DMT-like", "JKR-like") for kind in ("elastic", "one relaxation")}
    curve = {"depth": [-1.0, 1.0], "force": [0.0, -1.0], "time": [0.0, 1.0], "pull_off_force": 1.5}
    content = {
        "path": {"depth": 4.0, "start": -3.0, "rate": 20.0, "dwell": 0.2, "modulus_ratio": 0.1},
        "shared_files": ["scene"],
        "rows": [row],
        "curves": [{"name": name, **curve} for name in ("Hertz", "rubbery", "glassy")],
        "tolerance": 0.05,
        "stand_ins": points,
        "ranges": [{"tabor": mu, **ranges} for mu in (0.2, 1.0)],
        "safe": [{"stand_in": "one", "instead_of": "ten", "over": "decades", "low": 0.0, "high": 1.5}],
    }
    path = measured(content)
    made(figure_effects, path, folder=tmp_path)
    made(table_effects, path, folder=tmp_path)
    assert files_in(tmp_path) == pictures("figure-effects") | tables("effects", "stand-ins")
    text = (tmp_path / "effects.md").read_text(encoding="utf-8")
    assert "hard_contact.py" in text
    assert "march.py 7" in text
    cells = [cell.strip() for cell in text.splitlines()[2].strip("|").split("|")]
    assert cells[list(table_effects.COLUMNS).index("Time a step (µs)")] == "20"
    axes = drawing.figure(height=2.0).subplots()
    figure_effects.draw_stand_ins(axes, content)
    assert [5.0, 5.0] in [list(line.get_ydata()) for line in axes.lines]  # the tolerance in percent
    assert "| 1.5" in (tmp_path / "stand-ins.md").read_text(encoding="utf-8")


def test_recommendations(measured, tmp_path):
    row = {
        "sample": "paper",
        "quantity": "pull_off_force",
        "tolerance": 0.1,
        "kept": 4,
        "cases": 20,
        "worst_error": 0.2,
        "simplified": 5,
        "by_estimate": 1,
        "slower": 1,
        **dict.fromkeys(("full_seconds", "ratio", "seconds"), SPREAD),
    }
    none = row | {
        "kept": 0,
        "simplified": 0,
        "slower": 0,
        "worst_error": None,
        "full_seconds": UNKNOWN,
        "ratio": UNKNOWN,
    }
    made(table_recommendations, measured({"accuracy": 1.5e-3, "results": [row, none]}), folder=tmp_path)
    text = (tmp_path / "recommendations.md").read_text(encoding="utf-8")
    assert "| 4 of 5" in text
    assert "0.02 (0.06)" in text
    assert "| 0 of 0" in text
    assert "nan" not in text.lower()


def test_broad_band(measured, tmp_path):
    pairs = ((0.1, 1.2), (10.0, None))
    points = [{"unloading_rate": rate, "amplification": x, "own_amplification": x} for rate, x in pairs]
    solid = {"n": 0.2, "compliances": [0.9], "times": [1.0], "points": points}
    curves = [{"name": "n = 0.2", "preload": preload, **solid} for preload in (10.0, 30.0)]
    curves += [{"name": f"other {i}", "preload": 30.0, **solid, "n": None} for i in range(4)]
    made(figure_broad_band, measured({"modulus_ratio": 0.1, "curves": curves}), folder=tmp_path)
    assert files_in(tmp_path) == pictures("figure-broad-band")
    axes = drawing.figure(height=2.0).subplots()
    names = [curve["name"] for curve in curves[1:]]
    figure_broad_band.draw_amplification(axes, curves, names, 0.1, "amplification")
    assert [line.get_linestyle() for line in axes.lines[:2]] == [":", "-"]
