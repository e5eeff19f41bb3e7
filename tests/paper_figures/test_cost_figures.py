"""Figures and tables of cost, effects and hard cases, from made-up results."""

import json
from pathlib import Path

import numpy as np
import pytest

from bem.designs import PAPER_RANGES
from paper_figures import (
    drawing,
    figure_accuracy_cost,
    figure_amortisation,
    figure_broad_band,
    figure_cost_growth,
    figure_effects,
    figure_hard_cases,
    figure_surrogate_map,
    figure_training_cost,
    table_accuracy_cost,
    table_effects,
    table_recommendations,
)
from paper_figures.cost_style import paper_seconds

SPREAD = {"count": 3, "median": 0.02, "low": 0.01, "high": 0.03, "p95": 0.05, "largest": 0.06, "mean": 0.02}
UNKNOWN = dict.fromkeys(SPREAD)


@pytest.fixture
def write(tmp_path):
    def written(content):
        path = tmp_path / "result.json"
        path.write_text(json.dumps({"host": "a machine", **content}), encoding="utf-8")
        return path

    return written


def tool(kind, setting, error=0.01, **more):
    spread = SPREAD | {"median": error}
    return {
        "kind": kind,
        "setting": setting,
        "protocols": 3,
        "repeats": 2,
        "failures": 0,
        "seconds": SPREAD if kind != "measurement steps" else UNKNOWN,
        "run_totals": [1.0, 1.1],
        "errors": dict.fromkeys(("pull_off_force", "hysteresis", "force"), spread),
        **more,
    }


TOOLS = [
    tool("measurement steps", ""),
    tool("solver", "standard"),
    tool("paper's discretisation", "50 nodes, 50 steps") | {"protocols": 1},
    tool("closed form", "Hertz, rubbery", error=1.7) | {"protocols": 2},
    tool("surrogate", "M1-concat, ONNX batch", way="ONNX batch", model="M1-concat"),
    tool("surrogate", "M2-FiLM, ONNX batch", error=0.02, way="ONNX batch", model="M2-FiLM"),
    tool("surrogate", "M3-FiLM, ONNX batch", error=0.03, way="ONNX batch", model="M3-FiLM"),
    tool("surrogate", "M4-FiLM, ONNX batch", error=0.04, way="ONNX batch", model="M4-FiLM"),
]


def names(folder):
    return {path.name for path in folder.iterdir()} - {"result.json"}


def pictures(*stems):
    return {f"{stem}.{kind}" for stem in stems for kind in ("pdf", "png")}


def tables(*stems):
    return {f"{stem}.{kind}" for stem in stems for kind in ("md", "csv", "tex")}


CONTENT = {"protocols": 3, "repeats": 2, "truth_target": 7e-5, "tools": TOOLS}


def test_accuracy_and_cost(write, tmp_path):
    path = write({**CONTENT, "missing": ["M2-FiLM"], "outdated": ["M1-concat"]})
    figure_accuracy_cost.main(path, tmp_path)
    table_accuracy_cost.main(path, tmp_path)
    assert names(tmp_path) == pictures("figure-accuracy-cost") | tables("accuracy-cost", "fastest-tool")
    text = (tmp_path / "accuracy-cost.md").read_text(encoding="utf-8")
    assert "Not published yet: M2-FiLM. Trained otherwise than those compared: M1-concat." in text
    assert text.count("20 (10-30)") == 7
    hertz = next(line for line in text.splitlines() if "Hertz" in line)
    assert [cell.strip() for cell in hertz.split("|")[3:6]] == ["2", "2", "0"]
    assert hertz.split("|")[-3].strip() == "170 / 5"


def test_no_point_is_left_out_and_the_best_and_worst_have_names():
    drawn = figure_accuracy_cost.drawing.figure(height=3.0)
    axes = drawn.subplots()
    figure_accuracy_cost.draw(axes, TOOLS, "force")
    points = [line for line in axes.lines if len(line.get_xdata()) == 1 and line.get_marker() != "None"]
    assert len(points) == len(TOOLS) - 1
    assert max(float(line.get_ydata()[0]) for line in points) == figure_accuracy_cost.LARGEST
    assert sum(line.get_markerfacecolor() == "white" for line in points) == 2
    words = {text.get_text() for text in axes.texts}
    assert {"standard", "Hertz", "M1-concat", "M4-FiLM"} <= words
    assert not {"M2-FiLM", "M3-FiLM"} & words
    figure_accuracy_cost.drawing.plt.close(drawn)


def timed_tool(kind, setting, seconds, p95, **more):
    found = tool(kind, setting, **more)
    found["seconds"] = SPREAD | {"median": seconds}
    found["errors"] = dict.fromkeys(found["errors"], SPREAD | {"p95": p95})
    return found


def test_the_fastest_tool_is_the_quickest_that_keeps_the_error():
    choose = table_accuracy_cost.fastest
    tools = [
        timed_tool("solver", "draft", 2e-3, 0.01),
        timed_tool("solver", "standard", 8e-3, 0.002),
        timed_tool("surrogate", "M1, ONNX batch", 1e-4, 0.02, way="ONNX batch", model="M1"),
        timed_tool("surrogate", "M1, ONNX single", 4e-3, 0.02, way="ONNX single", model="M1"),
        timed_tool("closed form", "Hertz", 1e-5, 0.001) | {"protocols": 2},
        timed_tool("solver", "broken", 1e-5, 0.001) | {"failures": 1},
    ]
    assert choose(tools, "force", 0.05, batch=True) == "M1, ONNX batch (0.1 ms)"
    assert choose(tools, "force", 0.05, batch=False) == "solver, draft (2 ms)"
    assert choose(tools, "force", 0.01, batch=True) == "solver, draft (2 ms)"
    assert choose(tools, "force", 0.005, batch=True) == "solver, standard (8 ms)"
    assert choose(tools, "force", 0.001, batch=True) == "none"


def test_the_table_of_choices_goes_between_the_marks_of_the_page(write, tmp_path):
    begin, end = (f"<!-- {mark}{table_accuracy_cost.PLACE} -->" for mark in ("", "/"))
    page = tmp_path / "page.md"
    page.write_text(f"before\n\n{begin}\n\nold\n\n{end}\n\nafter\n", encoding="utf-8")
    for _ in range(2):
        table_accuracy_cost.main(write(CONTENT), tmp_path, page)
    text = page.read_text(encoding="utf-8")
    assert text.startswith("before\n\n<!--")
    assert text.endswith("-->\n\nafter\n")
    assert "old" not in text
    assert text.count("| Error wanted (%) |") == 1
    page.write_text("no marks", encoding="utf-8")
    with pytest.raises(ValueError, match="the page must hold <!-- fastest tool -->"):
        table_accuracy_cost.main(write(CONTENT), tmp_path, page)
    cost = (Path(__file__).parents[2] / "docs" / "cost.md").read_text(encoding="utf-8")
    assert cost.count(begin) == cost.count(end) == 1


def test_papers_seconds_come_from_its_own_numbers():
    seconds = paper_seconds()
    assert seconds["paper's solver (mean)"] == pytest.approx(138.2, abs=0.1)
    assert seconds["paper's surrogate"] == 0.16


def test_effects(write, tmp_path):
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
    path = write(
        {
            "path": {"depth": 4.0, "start": -3.0, "rate": 20.0, "dwell": 0.2, "modulus_ratio": 0.1},
            "shared_files": ["scene"],
            "rows": [row],
            "curves": [{"name": name, **curve} for name in ("Hertz", "rubbery", "glassy")],
            "tolerance": 0.05,
            "stand_ins": points,
            "ranges": [{"tabor": mu, **ranges} for mu in (0.2, 1.0)],
            "safe": [{"stand_in": "one", "instead_of": "ten", "over": "decades", "low": 0.0, "high": 1.5}],
        }
    )
    figure_effects.main(path, tmp_path)
    table_effects.main(path, tmp_path)
    assert names(tmp_path) == pictures("figure-effects") | tables("effects", "stand-ins")
    text = (tmp_path / "effects.md").read_text(encoding="utf-8")
    assert "hard_contact.py" in text
    assert "march.py 7" in text
    assert "| 1.5" in (tmp_path / "stand-ins.md").read_text(encoding="utf-8")


def test_recommendations(write, tmp_path):
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
    table_recommendations.main(write({"accuracy": 1.5e-3, "results": [row, none]}), tmp_path)
    text = (tmp_path / "recommendations.md").read_text(encoding="utf-8")
    assert "| 4 of 5" in text
    assert "| 0 of 0" in text
    assert "nan" not in text.lower()


def test_growth(write, tmp_path):
    def curve(name):
        times = [{"median": 1e-3 * x, "low": 0.9e-3 * x, "high": 1.2e-3 * x} for x in (1, 2, 4)]
        points = [{name: float(x), "seconds": SPREAD | time} for x, time in zip((1, 2, 4), times, strict=True)]
        return {"points": points, "exponent": 1.0, "error": 0.0, "iterations": 0.25, "iterations_error": 0.01}

    curves = {name: curve(name) for name in figure_cost_growth.LABELS}
    box = {"exponents": dict.fromkeys(PAPER_RANGES, 0.5), "explained": 0.9, "trajectories": 60}
    path = write({"solver": curves, "baseline": curves, "data_set": box})
    figure_cost_growth.main(path, tmp_path, tmp_path)
    assert names(tmp_path) == pictures("figure-cost-growth") | tables("cost-growth")
    assert "0.25 ± 0.01" in (tmp_path / "cost-growth.md").read_text(encoding="utf-8")


def test_amortisation_without_and_with_a_surrogate(write, tmp_path):
    lines = [
        {"name": "solver, standard", "fixed_seconds": 0.0, "query_seconds": 0.01},
        {"name": "M1-concat, ONNX batch", "fixed_seconds": 1e3, "query_seconds": 0.001},
        {"name": "paper's solver", "fixed_seconds": 0.0, "query_seconds": 138.0},
    ]
    crossing = {"surrogate": "M1-concat, ONNX batch", "solver": "solver, standard", "queries": 1.1e5}
    never = {"surrogate": "paper's surrogate", "solver": "solver, standard", "queries": None}
    content = {"data_set_seconds": 100.0, "missing": [], "unmeasured": ["M2-FiLM"]}
    content |= {"retrained": ["M2-gated"], "outdated": ["M1-concat"]}
    figure_amortisation.main(write({**content, "lines": lines, "break_even": [crossing, never]}), tmp_path, tmp_path)
    text = (tmp_path / "amortisation.md").read_text(encoding="utf-8")
    assert "Published but not measured: M2-FiLM. Trained anew since they were measured: M2-gated. " in text
    assert "Trained otherwise than those compared: M1-concat." in text
    figure_amortisation.main(write({**content, "lines": lines[:1], "break_even": []}), tmp_path, tmp_path)
    assert names(tmp_path) == pictures("figure-amortisation") | tables("amortisation")
    assert "never" in "".join(
        cell for row in figure_amortisation.rows_of({"lines": lines, "break_even": [never]}) for cell in row
    )


@pytest.mark.parametrize("published", [False, True])
def test_cost_of_training(write, tmp_path, published):
    history = {key: [1.0, 0.5] for key in ("core_minutes", "validation_mse", "best_mse")}
    run = {"name": "M1-concat", "epochs": 2, "core_minutes": 2.0, "test_mse": 4e-4, "history": history}
    content = {"paper_mse": 5e-4, "minutes_to_paper_mse": 1.5 if published else None, "beside": []} | (
        {
            "models": [run],
            "beside": [run | {"name": "M1-concat-8-epochs", "core_minutes": 1.0, "test_mse": 8e-4}],
            "shares": [
                {"trajectories": n, "solver_seconds": 0.01 * n, "mse": 1.0 / n, "mse_sd": 0.0} for n in (10, 100)
            ],
        }
        if published
        else {"models": [], "shares": []}
    )
    figure_training_cost.main(write(content), tmp_path)
    assert names(tmp_path) == pictures("figure-training-cost")
    axes = drawing.figure(height=2.0).subplots()
    figure_training_cost.draw_time(axes, content)
    held_out = [line.get_xydata()[0].tolist() for line in axes.lines if line.get_label() == "held-out, end of a run"]
    assert held_out == ([[2.0, 4e-4], [1.0, 8e-4]] if published else [])
    assert ("1.5 core minutes" in " ".join(text.get_text() for text in axes.texts)) == published


def test_hard_cases(write, tmp_path):
    numbers = {
        "refined_status": "completed",
        "change": 1e-3,
        "work_change": 1e-3,
        "energy": 0.1,
        "end_over_pull_off": 0.5,
        "jumps": 3,
        "steps": 100,
        "seconds": 0.01,
    }
    rows = [
        {"where": "inside", "tabor": mu, "unloading_rate": 1.0 / mu, "status": status, **numbers, "change": change}
        for mu, status, change in ((0.5, "completed", 1e-3), (1.0, "completed", 1e-2), (2.0, "stopped", None))
    ]
    coarse = {"draft": {"status": "completed", "change": 0.05}, "0.05": {"status": "stopped", "change": None}}
    extreme = {"name": "zero dwell", "status": "completed", "coarse": coarse, **numbers}
    path = write({"accuracy": "standard", "refinement": 4.0, "map": rows, "extremes": [extreme]})
    soak = tmp_path / "soak.json"
    figure_hard_cases.main(path, tmp_path, tmp_path, soak)
    assert names(tmp_path) == pictures("figure-hard-cases") | tables("hard-cases")
    text = (tmp_path / "hard-cases.md").read_text(encoding="utf-8")
    assert "2 of 3 completed" in text
    assert "`make soak` has not been run" in text
    named = next(line for line in text.splitlines() if "zero dwell" in line)
    assert [cell.strip() for cell in named.split("|")[6:8]] == ["5", "stopped"]


def test_the_soak_is_shown_among_the_hard_cases():
    found = {
        "protocols": 100,
        "raised": 0,
        "silent": 1,
        "spikes": 2,
        "statuses": {"completed": 99, "stopped": 1},
        "slowest_seconds": 2.0,
        "memory_growth": 0.003,
    }
    rows = figure_hard_cases.soak_rows({"inside": found, "beyond": found | {"memory_growth": None}})
    assert all(len(row) == len(figure_hard_cases.HEADER) for row in rows)
    assert rows[0][:2] == [
        "soak inside the box: 0 exceptions, 1 silent non-finite, 2 with a lone spike, memory growth 0.3 %",
        "99 of 100 completed",
    ]
    assert "memory growth not measured" in rows[1][0]


def test_surrogate_map(write, tmp_path):
    generator = np.random.default_rng(0)
    protocols = {name: np.geomspace(low, high, 30).tolist() for name, (low, high) in PAPER_RANGES.items()}
    found = {"force": generator.uniform(0.01, 0.1, 30).tolist()}
    case = {
        "protocol": dict.fromkeys(PAPER_RANGES, 1.0),
        "index": 7,
        "errors": {"force": 0.1, "pull_off_force": 0.2},
        "causes": ["jump"],
        "corner": True,
        "force": [0.0, 1.0],
        "predicted": [0.1, 0.9],
    }
    out = [
        {"quantity": name, "side": side, "beyond": beyond, "errors": dict.fromkeys(("force", "pull_off_force"), SPREAD)}
        for name in PAPER_RANGES
        for side in ("above", "below")
        for beyond in (0.0, 0.05, 0.2, 1.0)
    ]
    path = write(
        {
            "model": "M1-concat",
            "outdated": ["split", "recipe"],
            "test": {"protocols": protocols, "errors": found},
            "by_cause": {"jump": SPREAD, "narrow peak": UNKNOWN | {"count": 0}},
            "worst": [case] * 3,
            "out_of_range": out,
        }
    )
    figure_surrogate_map.main(path, tmp_path, tmp_path)
    wanted = pictures("figure-surrogate-map", "figure-surrogate-worst") | tables("surrogate-map")
    assert names(tmp_path) == wanted
    text = (tmp_path / "surrogate-map.md").read_text(encoding="utf-8")
    assert len([line for line in text.splitlines() if line.startswith("| ")]) == 2 + 3 + 5 * 2 * 4
    assert "tabor above by 100 %" in text
    assert "trained otherwise than those compared, with another split and recipe." in text


def test_broad_band(write, tmp_path):
    pairs = ((0.1, 1.2), (10.0, None))
    points = [{"unloading_rate": rate, "amplification": x, "own_amplification": x} for rate, x in pairs]
    solid = {"n": 0.2, "compliances": [0.9], "times": [1.0], "points": points}
    curves = [{"name": "n = 0.2", "preload": preload, **solid} for preload in (10.0, 30.0)]
    curves += [{"name": f"other {i}", "preload": 30.0, **solid, "n": None} for i in range(4)]
    figure_broad_band.main(write({"modulus_ratio": 0.1, "curves": curves}), tmp_path)
    assert names(tmp_path) == pictures("figure-broad-band")


@pytest.mark.parametrize("module", [figure_effects, figure_accuracy_cost, figure_hard_cases, figure_broad_band])
def test_a_missing_measurement_names_the_command_that_makes_it(module, tmp_path):
    with pytest.raises(FileNotFoundError, match="`make measure-"):
        module.main(tmp_path / "absent.json", tmp_path)
