"""What the figures and tables of the models plot, from small result files."""

import csv
import importlib
import json

import matplotlib.pyplot as plt
import numpy as np
import pytest

from paper_figures import (
    drawing,
    figure_5,
    figure_6,
    figure_7,
    figure_architectures,
    figure_features,
    figure_fms_transfer,
    figure_learning_curves,
    figure_mse_mae,
    graphical_abstract,
    models_style,
    table_models,
    table_persson_brener,
    table_protocols_canonical,
    table_quartiles,
)
from surrogate.architectures.naming import FAMILIES, names

PERCENTS = ("pull_off_force_percent", "hysteresis_percent", "pull_off_time_percent", "nmae_percent")
HISTORY = {"epoch": [1.0, 2.0, 3.0], "validation_mse": [0.3, 0.1, 0.2]}


def write(path, content):
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def comparison(trained):
    one = {"median": 2.0}
    models = {
        name: {
            "parameters": 1000 * (100 + rank),
            "mse": 1e-3 * (rank + 1),
            "mae": 1e-2 * (rank + 1),
            "dtw_rmse": 2e-2 * (rank + 1),
            "test": {"nmae_percent": {"median": 0.7}, "pull_off_force_percent": one, "hysteresis_percent": one},
            "recipe": {"name": "swift"},
            "training_trajectories": 9960,
            "epochs": 3,
            "core_seconds": 1800.0,
            "history": HISTORY,
        }
        for rank, name in enumerate(trained)
    }
    missing = [name for name in names() if name not in trained]
    beside = {"M1-concat-large": models[trained[0]] | {"training_trajectories": 120_000}}
    common = {"missing": missing, "outdated": {}, "differences": {}, "beside": beside}
    return {"models": models, **common, "comparison": {"ranking": list(trained)}}


@pytest.fixture
def kept(monkeypatch):
    """The figures that are drawn, kept open instead of written."""
    figures = []
    monkeypatch.setattr(drawing, "save", lambda drawn, *_: figures.append(drawn))
    yield figures
    plt.close("all")


@pytest.fixture
def regimes(tmp_path):
    def regime(sample):
        steps = {"time": [0.0, 1.0], "indentation": [0.0, float(sample)], "predicted": [0.5, -1.0 * sample]}
        return {
            "sample": sample,
            "protocol": {
                "tabor": 0.2 if sample in (1, 2, 3, 7, 8, 9) else 3.2,
                "peak_indentation": 5.0,
                "loading_rate": 10.0,
                "dwell_time": 1.0 if sample < 7 else 1e-3,
                "unloading_rate": 200.0,
            },
            "native": {"time": [0.0, 1.0], "indentation": [0.0, float(sample)], "force": [0.6, -1.1 * sample]},
            "steps": steps,
            "errors_percent": {"pull_off_force": 1.5, "hysteresis": 0.5},
            "seconds": {"solver": 0.01, "keras_call": 0.1, "predictor": 0.006, "predictor_batch": 0.0008},
            "paper_seconds": {"solver": 658.0, "surrogate": 0.12},
        }

    config = {"model": "M1-concat", "accuracy": "standard", "batch": 1024}
    content = {"host": "a machine", "config": config, "regimes": [regime(sample) for sample in range(1, 13)]}
    return write(tmp_path / "canonical.json", content)


@pytest.fixture
def errors(tmp_path):
    values = np.geomspace(0.1, 10.0, 8)
    moments = {"mean": 2.0, "sd": 1.0, "median": 1.5, "p90": 6.0}
    content = {
        "config": {"model": "M1-concat"},
        "trajectories": 8,
        "quartiles": {
            name: {column: {"mean": 2e-3, "sd": 1e-3} for column in ("mse", *PERCENTS)}
            for name in ("Q1", "Q2", "Q3", "Q4")
        },
        "overall": dict.fromkeys((*PERCENTS, "resolution_floor_percent"), moments),
        "spearman": {"pull_off_and_hysteresis": 0.25, "pull_off_and_nmae": 0.5},
        "per_trajectory": {**{name: values.tolist() for name in PERCENTS}, "quartile": [0, 0, 1, 1, 2, 2, 3, 3]},
    }
    return write(tmp_path / "errors.json", content)


@pytest.fixture
def cracks(tmp_path):
    point = {
        "unloading_rate": 1.0,
        "theory": 2.0,
        "theory_at_own_velocity": 2.1,
        "solver": 2.2,
        "surrogate": 2.3,
    }
    point["protocol"] = {"tabor": 3.24, "peak_indentation": 80.0, "loading_rate": 1.3895, "dwell_time": 3.0}
    points = [{**point, "point": k, "crack_velocity": 1.0 * k, "own_crack_velocity": 1.1 * k} for k in range(1, 15)]
    summary = {
        f"{name}_{part}_percent": 1.0
        for name in ("solver_against_theory", "solver_against_theory_at_own_velocity", "surrogate_against_theory")
        for part in ("median", "largest")
    }
    summary |= {"extrapolation_percent": 1.25, "trained_up_to_tabor": 3.2}
    theory = {"crack_velocity": [0.1, 10.0], "effective_energy": [1.0, 5.0]}
    content = {"config": {"model": "M1-concat"}, "summary": summary, "points": points, "theory": theory}
    return write(tmp_path / "cracks.json", content)


def efficiency():
    folds = [{"history": HISTORY}]
    shares = [{"percent": p, "mse_mean": 1.0 / p, "mse_sd": 0.1 / p, "folds": folds} for p in (75.0, 12.5)]
    full = {"mse": 5e-3, "epochs": 15, "history": HISTORY}
    return {"config": {"architecture": "M1-concat"}, "full": full, "shares": shares}


def test_each_model_looks_the_same_everywhere_and_no_two_alike():
    looks = {(models_style.color(name), models_style.marker(name)["marker"]) for name in names()}
    assert len(looks) == 18
    assert models_style.marker("M1-concat")["marker"] == "^"
    assert models_style.color("M1-concat") == drawing.BLUE


def is_reference(line):
    """Whether a line is drawn as M1-concat is."""
    shape, color = models_style.marker("M1-concat")["marker"], models_style.color("M1-concat")
    return (line.get_marker(), line.get_color()) == (shape, color)


def test_the_papers_colour_is_used_for_nothing_else():
    ours = {drawing.BLUE, drawing.VERMILION, drawing.GREEN, drawing.PURPLE, drawing.ORANGE, drawing.SKY, drawing.BLACK}
    assert drawing.PAPER not in ours
    assert models_style.paper_marker("M1-concat")["markeredgecolor"] == drawing.PAPER


def test_missing_models_are_named():
    assert models_style.missing_note([]) == ""
    missing = ["M1-gated", *(f"M2-{c}" for c in ("concat", "FiLM", "gated"))]
    note = "not trained yet, 4 of 18: M1-gated, all of M2"
    assert models_style.missing_note(missing) == note
    differences = {name: ["recipe"] for name in ("M3-FiLM", "M4-FiLM", "M1-concat-8-epochs")} | {"M6-FiLM": ["split"]}
    assert models_style.missing_note(missing, differences) == (
        f"{note}; trained with another recipe: M3-FiLM, M4-FiLM; trained with another split: M6-FiLM"
    )
    assert models_style.missing_note([], {"M3-FiLM": ["recipe", "backend"]}) == (
        "trained with another recipe and backend: M3-FiLM"
    )


def outdated(content, *names_):
    """The same comparison without these models, which are trained by another recipe."""
    kept = {name: one for name, one in content["models"].items() if name not in names_}
    sentences = {name: f"{name} is left out: `make models` trains it anew." for name in names_}
    ranking = {"ranking": list(kept)}
    differences = {name: ["recipe"] for name in names_}
    return content | {"models": kept, "differences": differences, "outdated": sentences, "comparison": ranking}


def test_what_is_trained_otherwise_is_not_called_untrained(tmp_path, cracks, kept):
    found = write(tmp_path / "c.json", outdated(comparison(names()), "M2-FiLM"))
    figure_mse_mae.main(found, tmp_path)
    figure_learning_curves.main(found, tmp_path)
    figure_5.main(found, cracks, tmp_path / "absent.json", tmp_path)
    assert {drawn.get_supxlabel() for drawn in kept} == {"trained with another recipe: M2-FiLM"}
    table_models.main(found, tmp_path)
    text = (tmp_path / "models.md").read_text(encoding="utf-8")
    assert "M2-FiLM is left out: `make models` trains it anew." in text
    assert "ot trained yet" not in text


@pytest.mark.parametrize("trained", [["M1-concat"], names()], ids=["one", "all"])
def test_figure_mse_mae_plots_the_trained_and_names_the_rest(trained, tmp_path, kept):
    figure_mse_mae.main(write(tmp_path / "c.json", comparison(trained)), tmp_path)
    axes = kept[0].axes[0]
    plotted = {line.get_label(): line for line in axes.lines if line.get_label() in names()}
    assert list(plotted) == trained
    assert plotted["M1-concat"].get_xydata().tolist() == [[1e-3, 1e-2]]
    assert plotted["M1-concat"].get_color() == models_style.color("M1-concat")
    note = kept[0].get_supxlabel()
    assert ("17 of 18" in note) == (len(trained) == 1)


def test_figure_5_with_one_model_and_no_data_efficiency(tmp_path, cracks, kept):
    found = write(tmp_path / "c.json", comparison(["M1-concat"]))
    figure_5.main(found, cracks, tmp_path / "absent.json", tmp_path)
    curves, sizes, energies, shares = kept[0].axes
    assert curves.lines[0].get_ydata().tolist() == HISTORY["validation_mse"]
    assert curves.lines[1].get_xydata().tolist() == [[2.0, 0.1]]
    assert sizes.lines[-1].get_xydata().tolist() == [[100.0, 2e-2]]
    by_label = {line.get_label(): line.get_xydata() for line in energies.lines}
    assert by_label["solver"][3].tolist() == [4.0, 2.2]
    assert by_label["solver, own velocity"][3].tolist() == pytest.approx([4.4, 2.2])
    assert by_label["M1-concat"][3].tolist() == [4.0, 2.3]
    assert "1.25 %" in energies.get_title(loc="right")
    assert "make data-efficiency" in shares.texts[0].get_text()


def test_figure_5_data_efficiency(tmp_path, cracks, kept):
    found = write(tmp_path / "c.json", comparison(names()))
    figure_5.main(found, cracks, write(tmp_path / "e.json", efficiency()), tmp_path)
    shares = kept[0].axes[3]
    points = shares.containers[0].lines[0].get_xydata()
    np.testing.assert_allclose(points, [[12.5, 1.0 / 12.5], [75.0, 1.0 / 75.0]])
    assert [100.0, 5e-3] in [line.get_xydata()[0].tolist() for line in shares.lines]


def test_figure_6_plots_solver_and_prediction(tmp_path, regimes, kept):
    figure_6.main(regimes, tmp_path)
    assert len(kept[0].axes) == 4
    panel = kept[0].axes[1]
    assert panel.get_title(loc="right") == r"$\mu = 3.2$, long dwell"
    markers = {line.get_label(): line for line in panel.lines if line.get_label().startswith("(")}
    assert list(markers) == ["(4)", "(5)", "(6)"]
    assert markers["(5)"].get_xydata().tolist() == [[0.0, 0.5], [5.0, -5.0]]
    assert {is_reference(line) for line in markers.values()} == {True}
    assert [text.get_text() for text in panel.texts] == ["(4)", "(5)", "(6)"]


def test_figure_7_counts_every_trajectory_once(tmp_path, errors, kept):
    figure_7.main(errors, tmp_path)
    for axes in kept[0].axes[:2]:
        assert sum(patch.get_height() for patch in axes.patches) == pytest.approx(100.0)
        assert sorted(line.get_xdata()[0] for line in axes.lines) == [1.5, 6.0]
        kept[0].draw_without_rendering()
        highest = max(patch.get_window_extent().y1 for patch in axes.patches)
        assert axes.get_legend().get_window_extent().y0 > highest
    assert sum(len(line.get_xdata()) for line in kept[0].axes[2].lines) == 8


def test_figure_learning_curves_needs_a_model(tmp_path, kept):
    found = write(tmp_path / "c.json", comparison(["M1-concat"]))
    with pytest.raises(FileNotFoundError, match="make models"):
        figure_learning_curves.main(found, tmp_path)
    figure_learning_curves.main(write(tmp_path / "c.json", comparison(names())), tmp_path)
    for axes in kept[0].axes:
        assert [line.get_label() for line in axes.lines[::2]] == list(FAMILIES)


def test_figure_learning_curves_says_so_where_no_model_may_be_compared(tmp_path, kept):
    trained = ["M1-concat", "M1-FiLM", "M4-gated"]
    for old, lines in ((trained[1:], [0, 0]), (trained[1:2], [0, 2]), (trained[2:], [2, 0])):
        found = write(tmp_path / "c.json", outdated(comparison(trained), *old))
        figure_learning_curves.main(found, tmp_path)
        panels = kept[-1].axes
        assert [len(axes.lines) for axes in panels] == lines
        words = [" ".join(text.get_text() for text in axes.texts) for axes in panels]
        assert ["to compare" in text for text in words] == [not count for count in lines]
        # The empty panel's limits are its own.
        assert all(axes.get_xlim()[1] > 2.0 for axes, count in zip(panels, lines, strict=True) if count)
        assert "trained with another recipe: " in kept[-1].get_supxlabel()


def test_figure_features_draws_what_is_there(tmp_path, kept):
    absent = tmp_path / "absent.json"
    with pytest.raises(FileNotFoundError, match="make feature-sets data-efficiency"):
        figure_features.main(absent, absent, tmp_path)
    sets = {name: {"validation_mse": 0.1, "history": HISTORY} for name in "ABCD"}
    figure_features.main(write(tmp_path / "f.json", {"sets": sets}), absent, tmp_path)
    first, second = kept[0].axes
    assert len(first.lines) == 8
    assert "make data-efficiency" in second.texts[0].get_text()
    figure_features.main(absent, write(tmp_path / "e.json", efficiency()), tmp_path)
    labels = [line.get_label() for line in kept[1].axes[1].lines[::2]]
    assert labels == ["100 %", "75 %", "12.5 %"]


def test_figure_fms_transfer(tmp_path, kept):
    predictions = {n: {"indentation": [0.0, 1.0], "predicted": [0.0, float(n)]} for n in ("100", "120", "140")}
    sample = {"sample": 8, "native": {"indentation": [0.0], "force": [0.0]}, "predictions": predictions}
    errors = {n: {"nmae_percent": {"median": float(n), "p90": 2.0 * float(n)}} for n in predictions}
    config = {"model": "M1-concat"}
    content = {"config": config, "sample": sample, "test_set": {"trajectories": 3, "errors": errors}}
    figure_fms_transfer.main(write(tmp_path / "f.json", content), tmp_path)
    first, second = kept[0].axes
    assert {line.get_label(): line.get_ydata()[-1] for line in first.lines[2:]}["$N = 140$"] == 140.0
    assert all(is_reference(line) for line in first.lines[2:])
    heights = [bar.get_height() for bars in second.containers for bar in bars if hasattr(bar, "get_height")]
    assert heights == [100.0, 120.0, 140.0, 200.0, 240.0, 280.0]


def test_architectures_are_drawn_from_their_graphs(tmp_path, kept):
    layers = [
        {"name": "sequence", "kind": "InputLayer", "label": "history", "width": 4, "parameters": 0, "inputs": []},
        {"name": "tabor", "kind": "InputLayer", "label": "Tabor", "width": 1, "parameters": 0, "inputs": []},
        {"name": "a", "kind": "LSTM", "label": "LSTM 7", "width": 7, "parameters": 5, "inputs": ["sequence"]},
        {
            "name": "g",
            "kind": "TaborGate",
            "label": "Gate",
            "width": 7,
            "parameters": 5,
            "inputs": ["a", "sequence", "tabor"],
        },
    ]
    graphs = {name: {"parameters": 10, "layers": layers} for name in names()}
    figure_architectures.main(write(tmp_path / "g.json", {"models": graphs}), tmp_path)
    assert len(kept[0].axes) == 6
    for axes in kept[0].axes:
        texts = [text.get_text() for text in axes.texts]
        assert texts.count("LSTM 7") == texts.count("Gate") == 3
        assert texts.count("10\nparameters") == texts.count(r"$\mu$") == 3
    assert figure_architectures.ranks(layers)["g"] == 2


def test_a_family_beyond_the_papers_leaves_its_figures_as_they_are(tmp_path, kept, monkeypatch):
    monkeypatch.setitem(FAMILIES, "M7", "one more")
    importlib.reload(models_style)
    assert len(models_style.family_handles()) == 6
    layers = [{"name": "sequence", "kind": "InputLayer", "label": "", "width": 4, "parameters": 0, "inputs": []}]
    graphs = {name: {"parameters": 10, "layers": layers} for name in names()}
    figure_architectures.main(write(tmp_path / "g.json", {"models": graphs}), tmp_path)
    assert [axes.get_title(loc="left")[:7] for axes in kept[0].axes] == [
        f"({letter}) M{number}:" for number, letter in enumerate("abcdef", start=1)
    ]


def test_graphical_abstract_states_the_medians(tmp_path, regimes, errors, kept):
    graphical_abstract.main(regimes, errors, tmp_path)
    text = " ".join(text.get_text() for text in kept[0].axes[1].texts)
    assert "pull-off force 1.5 %" in text
    assert "6 ms a prediction, solver 10 ms" in text
    (predicted,) = [line for line in kept[0].axes[2].lines if line.get_label() == "M1-concat"]
    assert is_reference(predicted)
    assert predicted.get_ydata().tolist() == [0.5, -5.0]


def read_csv(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def test_tables(tmp_path, regimes, errors, cracks):
    table_protocols_canonical.main(regimes, tmp_path)
    rows = read_csv(tmp_path / "protocols-canonical.csv")
    assert rows[1] == [
        "(1)",
        "10",
        "1",
        "200",
        "0.2",
        "5",
        "658",
        "0.01",
        "0.12",
        "0.1",
        "0.006",
        "8.0e-04",
        "1.5",
        "0.5",
    ]
    table_quartiles.main(errors, tmp_path)
    rows = read_csv(tmp_path / "quartiles.csv")
    assert rows[1][:3] == ["Q1", "paper", r"0.0853 $\pm$ 0.0229"]
    assert rows[2][:3] == ["", "here", r"2 $\pm$ 1"]
    table_persson_brener.main(cracks, tmp_path)
    assert read_csv(tmp_path / "persson-brener.csv")[2] == ["2", "1", "2", "2.2", "2", "2.1", "2.2", "2.3"]
    assert "1.25 % beyond" in (tmp_path / "persson-brener.md").read_text(encoding="utf-8")
    table_models.main(write(tmp_path / "c.json", comparison(["M1-concat"])), tmp_path)
    rows = read_csv(tmp_path / "models.csv")
    assert rows[1] == ["M1-concat, paper", "473,729", "5.00e-04", "0.0092", "0.0148", "-", "2.2", "1.1", *["-"] * 4]
    errors = ["0.001", "0.01", "0.02", "0.7", "2", "2"]
    assert rows[2] == ["M1-concat", "100,000", *errors, "swift", "9,960", "3", "1800"]
    assert rows[3] == ["M1-concat-large", "100,000", *errors, "swift", "120,000", "3", "1800"]
    assert "17 of 18" in (tmp_path / "models.md").read_text(encoding="utf-8")


def test_a_missing_result_names_its_target(tmp_path):
    for module, target in ((figure_6, "figure-6"), (figure_7, "figure-7"), (table_quartiles, "table-quartiles")):
        with pytest.raises(FileNotFoundError, match=f"`make {target}` makes it"):
            module.main(tmp_path / "absent.json", tmp_path)
