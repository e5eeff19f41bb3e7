"""The published M1-concat gives the same forces by every way of asking, within the bound the documents state."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import surrogate
from bem.dataset.designs import Design
from bem.dataset.measurement_steps import measurement_grid
from surrogate.data.features import edge_from_counts
from surrogate.prediction import validity as extrapolation
from surrogate.prediction.files import PUBLISHED
from surrogate.prediction.stream import AGREEMENT
from tests.surrogate.conftest import scenes

COUNT = 300
STREAMED = 40
ROOT = Path(__file__).resolve().parents[3]

pytestmark = pytest.mark.skipif(
    not (PUBLISHED / "M1-concat" / "model.onnx").is_file(), reason="M1-concat is not published here"
)


@pytest.fixture(scope="module")
def histories():
    columns = Design("log-uniform").protocols(COUNT, seed=5)
    return *measurement_grid(**columns), columns["tabor"]


@pytest.fixture(scope="module")
def forces(histories):
    times, indentations, tabor = histories
    # The design's extremes may lie beyond those of the training set by rounding.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", surrogate.ExtrapolationWarning)
        return {
            backend: surrogate.load("M1-concat", backend=backend).predict_history(times, indentations, scenes(tabor))
            for backend in ("onnx", "keras")
        }


def difference(found, expected):
    """The largest difference as a share of the history's force range."""
    return (np.abs(found - expected).max(axis=1) / np.ptp(expected, axis=1)).max()


def test_onnx_and_keras(forces):
    assert 0.0 < difference(forces["onnx"], forces["keras"]) < AGREEMENT


def test_stream_and_whole_sequence(histories, forces):
    model = surrogate.load("M1-concat")
    edge = edge_from_counts((50, 20, 50), STREAMED)
    streamed = [
        model.stream(scenes([tabor])[0]).run(times, indentations, edge[row])
        for row, (times, indentations, tabor) in enumerate(zip(*(part[:STREAMED] for part in histories), strict=True))
    ]
    for backend in ("onnx", "keras"):
        assert difference(np.array(streamed), forces[backend][:STREAMED]) < AGREEMENT


def test_the_documents_state_the_bounds():
    text = (ROOT / "docs" / "control.md").read_text(encoding="utf-8")
    agreement = f"{AGREEMENT:.0e}".replace("e-0", "e-")
    assert text.count(f"within {agreement} of") == 2
    points = ", ".join(f"{low:g} to {high:g}" for low, high in extrapolation.POINTS.values())
    for words in (
        rf"within {100 * extrapolation.START_TOLERANCE:g} % of $-\pi^{{2/3}}\mu$",
        f"{points}: the paper's N = 100 to 140",
        f"within {100 * extrapolation.BEND_TOLERANCE:g} % of the travel",
        f"a factor of {extrapolation.LARGEST_STEP_RATIO:g}",
    ):
        assert words in text
