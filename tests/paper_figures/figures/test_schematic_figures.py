"""Figures 1 and 4, and the wirings, against the solver's example and the Keras models."""

import importlib

from experiments.paper.architecture_graphs import graph
from paper_figures.figures import figure_1, figure_4
from paper_figures.models import figure_architectures
from paper_figures.style import drawing, models_style, schematics
from surrogate.architectures.naming import CONDITIONINGS, FAMILIES, Family, paper_names


def test_figure_1_shows_the_computed_force(examples):
    example, panels = examples["mapping"], figure_1.compose(examples).axes
    force = panels[3]
    drawn = [value for line in force.lines[:3] for value in line.get_ydata()]
    assert min(drawn) == min(example["native"]["force"])
    peak = next(line for line in force.lines if line.get_marker() == "o")
    assert peak.get_ydata()[0] == example["results"]["pull_off_force"]
    lowest = next(line for line in force.lines if line.get_marker() == "s")
    assert lowest.get_ydata()[0] == min(example["native"]["force"])
    axis = panels[2]
    depths = dict(zip((text.get_text() for text in axis.get_yticklabels()), axis.get_yticks(), strict=True))
    assert depths[r"$\hat\delta_0$"] < depths["0"] < depths[r"$\hat\delta_l$"]


def test_graphs_equal_the_keras_models():
    import surrogate
    from surrogate.architectures.naming import PAPER_PARAMETER_COUNTS

    # Every kind of layer; `tests/surrogate/architectures` counts the parameters of all models.
    shown = ("M1-concat", "M2-FiLM", "M3-concat", "M4-concat", "M4-gated", "M5-FiLM", "M6-concat")
    models = {name: graph(surrogate.build(name)) for name in shown}
    for name, model in models.items():
        assert sum(layer["parameters"] for layer in model["layers"]) == model["parameters"]
        assert model["parameters"] == PAPER_PARAMETER_COUNTS.get(name, model["parameters"])
        assert figure_architectures.ranks(model["layers"])["force"] == max(
            figure_architectures.ranks(model["layers"]).values()
        )
    assert models["M4-concat"]["receptive_field"] == 61
    gate = next(layer for layer in models["M4-gated"]["layers"] if layer["kind"] == "TaborGate")
    assert gate["inputs"] == ["block_4", "block_3", "tabor"]
    blocks = [layer for layer in models["M4-concat"]["layers"] if layer["kind"] == "ResidualBlock"]
    # As the paper states them in its appendix on layers.
    assert [layer["parameters"] for layer in blocks] == [13_760, 24_960, 82_816, 99_072]
    assert [layer["label"] for layer in blocks] == [
        "TCN 64, d = 1",
        "TCN 64, d = 2",
        "TCN 128, d = 4",
        "TCN 128, d = 8",
    ]
    assert [layer["label"] for layer in models["M5-FiLM"]["layers"]].count("Encoder, 4 heads") == 2
    channels = ["time", "indentation", "velocity", "edge"]
    panels = figure_4.compose({"channels": channels, "models": models}).axes
    texts = [text.get_text() for text in panels[3].texts]
    assert "width 256\n268,288 parameters" in texts
    assert "physical features\nvelocity, edge" in texts
    readout = [text.get_text() for text in panels[2].texts]
    assert readout.count("Dense 64\nReLU") == readout.count("Dense 1") == 3


def layer(name, layer_class, width, label, *inputs):
    return {"name": name, "kind": layer_class, "label": label, "width": width, "parameters": 5, "inputs": list(inputs)}


INPUT = layer("sequence", "InputLayer", 4, "history")


def test_architectures_are_drawn_from_graphs():
    layers = [INPUT, layer("tabor", "InputLayer", 1, "Tabor"), layer("a", "LSTM", 7, "LSTM 7", "sequence")]
    layers.append(layer("g", "TaborGate", 7, "Gate", "a", "sequence", "tabor"))
    graphs = {name: {"parameters": 10, "layers": layers} for name in paper_names()}
    panels = figure_architectures.compose({"models": graphs}).axes
    assert len(panels) == 6
    for axes in panels:
        texts = [text.get_text() for text in axes.texts]
        assert texts.count("LSTM 7") == texts.count("Gate") == 3
        assert texts.count("10\nparameters") == texts.count(r"$\mu$") == 3
    assert figure_architectures.ranks(layers)["g"] == 2
    graphs = {f"M1-{how}": {"parameters": 7 + index, "layers": [INPUT]} for index, how in enumerate(CONDITIONINGS)}
    axes = drawing.figure(height=2.0).subplots()
    figure_architectures.draw_family(axes, graphs, "M1", 1)
    across = {text.get_text(): text.get_position()[0] for text in axes.texts}
    for index, how in enumerate(CONDITIONINGS):
        assert across[how] == across[f"{7 + index}\nparameters"]
    axes = drawing.figure(height=2.0).subplots()
    schematics.arrow(axes, (0.0, 1.0), (2.0, 3.0))
    assert (axes.texts[0].xy, axes.texts[0].xyann) == ((2.0, 3.0), (0.0, 1.0))


def test_own_family_changes_no_paper_figure(monkeypatch):
    monkeypatch.setitem(FAMILIES, "M7", Family("one more"))
    importlib.reload(models_style)
    assert len(models_style.family_handles()) == 6
    graphs = {name: {"parameters": 10, "layers": [INPUT]} for name in paper_names()}
    assert [axes.get_title(loc="left")[:7] for axes in figure_architectures.compose({"models": graphs}).axes] == [
        f"({letter}) M{number}:" for number, letter in enumerate("abcdef", start=1)
    ]
