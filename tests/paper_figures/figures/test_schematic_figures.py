"""Figures 1 and 4, and the wirings, against the solver's example and the Keras models."""

import importlib
import json

from experiments.paper.architecture_graphs import graph
from paper_figures.figures import figure_1, figure_4, figure_architectures
from paper_figures.style import models_style
from surrogate.architectures.naming import FAMILIES, names
from tests.paper_figures.results import made, write


def test_figure_1_shows_the_computed_force(examples_path, tmp_path, kept):
    made(figure_1, examples_path, folder=tmp_path)
    example = json.loads(examples_path.read_text(encoding="utf-8"))["mapping"]
    force = kept[0].axes[3]
    drawn = [value for line in force.lines[:3] for value in line.get_ydata()]
    assert min(drawn) == min(example["native"]["force"])
    peak = next(line for line in force.lines if line.get_marker() == "o")
    assert peak.get_ydata()[0] == example["results"]["pull_off_force"]


def test_graphs_and_drawings_are_those_of_the_keras_models(tmp_path, kept):
    import surrogate
    from surrogate.architectures.naming import PAPER_PARAMETER_COUNTS

    models = {name: graph(surrogate.build(name)) for name in surrogate.names()}
    for name, found in models.items():
        assert sum(layer["parameters"] for layer in found["layers"]) == found["parameters"]
        assert found["parameters"] == PAPER_PARAMETER_COUNTS.get(name, found["parameters"])
        assert figure_architectures.ranks(found["layers"])["force"] == max(
            figure_architectures.ranks(found["layers"]).values()
        )
    assert models["M4-concat"]["receptive_field"] == 61
    gate = next(layer for layer in models["M4-gated"]["layers"] if layer["kind"] == "TaborGate")
    assert gate["inputs"] == ["block_4", "block_3", "tabor"]
    path = tmp_path / "graphs.json"
    channels = ["time", "indentation", "velocity", "edge"]
    path.write_text(json.dumps({"channels": channels, "models": models}), encoding="utf-8")
    made(figure_4, path, folder=tmp_path)
    texts = [text.get_text() for text in kept[0].axes[3].texts]
    assert "width 256\n268,288 parameters" in texts
    assert "physical features\nvelocity, edge" in texts


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
    made(figure_architectures, write(tmp_path / "g.json", {"models": graphs}), folder=tmp_path)
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
    made(figure_architectures, write(tmp_path / "g.json", {"models": graphs}), folder=tmp_path)
    assert [axes.get_title(loc="left")[:7] for axes in kept[0].axes] == [
        f"({letter}) M{number}:" for number, letter in enumerate("abcdef", start=1)
    ]
