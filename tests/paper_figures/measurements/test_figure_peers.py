"""Figure and table beside other software, from a made-up measurement."""

from paper_figures.measurements import figure_peers

RUNS = [
    ("tabor 1", "Adhesion", "128 x 128", 30.0, 1e-3),
    ("tabor 1", "Adhesion", "32 x 32", 1.0, 1e-2),
    ("tabor 1", "solver", "draft", 4e-3, 2e-3),
    ("tabor 3", "closed form", "JKR", 1e-3, 0.03),
    ("tabor 3", "paper's discretisation", "50 nodes", 1e-2, 0.1),
    ("Hertz", "solver", "draft", 2e-3, 1e-9),
    ("Hertz", "tamaas", "32 x 32", 2e-2, 1e-4),
]
CONTENT = {"host": "a processor", "packages": {"Adhesion": "0.1", "tamaas": "0.2"}, "start": 2.0}
CONTENT["runs"] = [dict(zip(("problem", "tool", "setting", "seconds", "error"), row, strict=True)) for row in RUNS]


def test_the_ends_of_curves_are_named_and_an_error_that_is_not_resolved_is_a_triangle():
    drawn = figure_peers.compose(CONTENT)
    names = {text.get_text() for axes in drawn.axes for text in axes.texts}
    assert names == {"draft", "32×32", "128×128", "JKR"}
    (axes,) = [
        axes for axes in figure_peers.compose(CONTENT).axes if axes.get_title() == "compression without adhesion"
    ]
    solver = [line for line in axes.lines if line.get_color() == figure_peers.STYLES["solver"]["color"]]
    assert [(line.get_marker(), line.get_markevery()) for line in solver] == [("o", []), ("v", None)]
