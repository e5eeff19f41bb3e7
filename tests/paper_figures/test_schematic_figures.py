"""Figures 1 and 4, and the wirings, against the solver's example and the Keras models."""

import json

import matplotlib.pyplot as plt
import pytest

from experiments.architecture_graphs import graph
from paper_figures import drawing, figure_1, figure_4, figure_architectures


@pytest.fixture
def kept(monkeypatch):
    figures = []
    monkeypatch.setattr(drawing, "save", lambda drawn, *_: figures.append(drawn))
    yield figures
    plt.close("all")


def test_figure_1_shows_the_computed_force(examples_path, tmp_path, kept):
    figure_1.main(examples_path, tmp_path)
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
    figure_4.main(path, tmp_path)
    texts = [text.get_text() for text in kept[0].axes[3].texts]
    assert "width 256\n268,288 parameters" in texts
    assert "physical features\nvelocity, edge" in texts
