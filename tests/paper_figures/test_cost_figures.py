"""Figures and tables of cost, effects and hard cases, from made-up results."""

import json

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
        "failures": 0,
        "seconds": SPREAD if kind != "measurement steps" else UNKNOWN,
        "run_totals": [1.0, 1.1],
        "errors": dict.fromkeys(("pull_off_force", "hysteresis", "force"), spread),
        **more,
    }


TOOLS = [
    tool("measurement steps", ""),
    tool("solver", "standard"),
    tool("paper's discretisation", "50 nodes, 50 steps"),
    tool("closed form", "Hertz, rubbery", error=1.0),
    tool("surrogate", "M1-concat, ONNX batch", way="ONNX batch", model="M1-concat"),
]


def names(folder):
    return {path.name for path in folder.iterdir()} - {"result.json"}


def pictures(*stems):
    return {f"{stem}.{kind}" for stem in stems for kind in ("pdf", "png")}


def tables(*stems):
    return {f"{stem}.{kind}" for stem in stems for kind in ("md", "csv", "tex")}


def test_accuracy_and_cost(write, tmp_path):
    content = {"protocols": 3, "baseline_protocols": 1, "repeats": 2, "truth_target": 7e-5, "tools": TOOLS}
    path = write({**content, "missing": ["M2-FiLM"]})
    figure_accuracy_cost.main(path, tmp_path)
    table_accuracy_cost.main(path, tmp_path)
    assert names(tmp_path) == pictures("figure-accuracy-cost") | tables("accuracy-cost")
    text = (tmp_path / "accuracy-cost.md").read_text(encoding="utf-8")
    assert "Not published yet: M2-FiLM" in text
    assert text.count("20 (10-30)") == 4
    hertz = next(line for line in text.splitlines() if "Hertz" in line)
    assert hertz.split("|")[-4].strip() == "-"


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
    }
    point = {"errors": {"Hertz": 0.3, "rubbery": 0.1}, "estimate": 0.0}
    points = [
        {"rate": 0.1, "recommended": "elastic rubbery, adhesive", **point},
        {"rate": 10.0, "recommended": "viscoelastic, adhesive", **point},
    ]
    curve = {"depth": [-1.0, 1.0], "force": [0.0, -1.0], "time": [0.0, 1.0], "pull_off_force": 1.5}
    path = write(
        {
            "path": {"depth": 4.0, "start": -3.0, "rate": 20.0, "dwell": 0.2, "modulus_ratio": 0.1},
            "shared_files": ["scene"],
            "rows": [row],
            "curves": [{"name": name, **curve} for name in ("Hertz", "rubbery", "glassy")],
            "tolerance": 0.05,
            "stand_ins": points,
        }
    )
    figure_effects.main(path, tmp_path)
    table_effects.main(path, tmp_path)
    assert names(tmp_path) == pictures("figure-effects") | tables("effects")
    assert "hard_contact.py" in (tmp_path / "effects.md").read_text(encoding="utf-8")


def test_recommendations(write, tmp_path):
    row = {
        "sample": "paper",
        "quantity": "pull_off_force",
        "tolerance": 0.1,
        "kept": 19,
        "cases": 20,
        "worst_error": 0.2,
        "simplified": 5,
        "by_estimate": 1,
        **dict.fromkeys(("full_seconds", "simple_seconds", "seconds"), SPREAD),
    }
    table_recommendations.main(write({"accuracy": 1.5e-3, "results": [row]}), tmp_path)
    assert "19 of 20" in (tmp_path / "recommendations.md").read_text(encoding="utf-8")


def test_growth(write, tmp_path):
    def curve(name):
        points = [{name: float(x), "seconds": SPREAD | {"median": 1e-3 * x}} for x in (1, 2, 4)]
        return {"points": points, "exponent": 1.0, "error": 0.0}

    curves = {name: curve(name) for name in figure_cost_growth.LABELS}
    box = {"exponents": dict.fromkeys(PAPER_RANGES, 0.5), "explained": 0.9, "trajectories": 60}
    path = write({"solver": curves, "baseline": curves, "data_set": box})
    figure_cost_growth.main(path, tmp_path, tmp_path)
    assert names(tmp_path) == pictures("figure-cost-growth") | tables("cost-growth")


def test_amortisation_without_and_with_a_surrogate(write, tmp_path):
    lines = [
        {"name": "solver, standard", "fixed_seconds": 0.0, "query_seconds": 0.01},
        {"name": "M1-concat, ONNX batch", "fixed_seconds": 1e3, "query_seconds": 0.001},
        {"name": "paper's solver", "fixed_seconds": 0.0, "query_seconds": 138.0},
    ]
    crossing = {"surrogate": "M1-concat, ONNX batch", "solver": "solver, standard", "queries": 1.1e5}
    never = {"surrogate": "paper's surrogate", "solver": "solver, standard", "queries": None}
    content = {"data_set_seconds": 100.0, "missing": []}
    figure_amortisation.main(write({**content, "lines": lines, "break_even": [crossing, never]}), tmp_path, tmp_path)
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
    extreme = {"name": "zero dwell", "status": "completed", **numbers}
    path = write({"accuracy": "standard", "refinement": 4.0, "map": rows, "extremes": [extreme]})
    figure_hard_cases.main(path, tmp_path, tmp_path)
    assert names(tmp_path) == pictures("figure-hard-cases") | tables("hard-cases")
    text = (tmp_path / "hard-cases.md").read_text(encoding="utf-8")
    assert "2 of 3 completed" in text
    assert "zero dwell" in text


def test_surrogate_map(write, tmp_path):
    generator = np.random.default_rng(0)
    protocols = {name: np.geomspace(low, high, 30).tolist() for name, (low, high) in PAPER_RANGES.items()}
    found = {"force": generator.uniform(0.01, 0.1, 30).tolist()}
    case = {
        "protocol": dict.fromkeys(PAPER_RANGES, 1.0),
        "causes": ["jump"],
        "force": [0.0, 1.0],
        "predicted": [0.1, 0.9],
    }
    out = [
        {"quantity": name, "side": side, "beyond": beyond, "errors": {"force": SPREAD}}
        for name in PAPER_RANGES
        for side in ("above", "below")
        for beyond in (0.0, 0.05, 0.2, 1.0)
    ]
    path = write(
        {
            "model": "M1-concat",
            "test": {"protocols": protocols, "errors": found},
            "by_cause": {"jump": SPREAD, "narrow peak": UNKNOWN | {"count": 0}},
            "worst": [case] * 3,
            "out_of_range": out,
        }
    )
    figure_surrogate_map.main(path, tmp_path)
    assert names(tmp_path) == pictures("figure-surrogate-map", "figure-surrogate-worst")


def test_broad_band(write, tmp_path):
    points = [{"unloading_rate": rate, "amplification": value} for rate, value in ((0.1, 1.2), (10.0, None))]
    solid = {"n": 0.2, "compliances": [0.9], "times": [1.0], "points": points}
    curves = [{"name": "n = 0.2", "preload": preload, **solid} for preload in (10.0, 30.0)]
    curves += [{"name": f"other {i}", "preload": 30.0, **solid, "n": None} for i in range(4)]
    figure_broad_band.main(write({"modulus_ratio": 0.1, "curves": curves}), tmp_path)
    assert names(tmp_path) == pictures("figure-broad-band")


@pytest.mark.parametrize("module", [figure_effects, figure_accuracy_cost, figure_hard_cases, figure_broad_band])
def test_a_missing_measurement_names_the_command_that_makes_it(module, tmp_path):
    with pytest.raises(FileNotFoundError, match="`make measure-"):
        module.main(tmp_path / "absent.json", tmp_path)
