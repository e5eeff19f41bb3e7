"""The page's own arithmetic against Python, without a browser; run by `make test-demo`.

Physical steps, pull-off and hysteresis from forces at steps, and half-widths of bands.
"""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

import surrogate
from bem.dataset.designs import QUANTITIES
from bem.dataset.physical_steps import physical_grid
from surrogate.data.features import edge_from_counts
from surrogate.prediction.bands import LEVELS, results

NAMES = (*QUANTITIES, "modulus_ratio")
COVERAGE = 0.9


@pytest.fixture(scope="module")
def model():
    return surrogate.load("accurate")


@pytest.fixture(scope="module")
def solids(model):
    """Corners of the training, and protocols over all of it, by name."""
    rng = np.random.default_rng(11)
    low, high = np.log([model.scaling.ranges[name] for name in NAMES]).T
    corners = np.array([[(row >> bit) & 1 for bit in range(6)] for row in range(64)], dtype=float)
    values = np.exp(low + (high - low) * np.concatenate([corners, rng.random((136, 6))]))
    values[:, 5] = np.minimum(values[:, 5], 1.0)
    return dict(zip(NAMES, values.T.copy(), strict=True))


@pytest.fixture(scope="module")
def grid(solids, model):
    return physical_grid(**solids, counts=model.counts)


@pytest.fixture(scope="module")
def forces(grid, model):
    """Forces with peaks in the unloading: broad, between two steps, and at its last step."""
    times, indentations = grid
    turn = sum(model.counts[:2]) - 1
    rng = np.random.default_rng(12)
    centre = rng.integers(turn + 1, times.shape[1], len(times))
    width = rng.uniform(0.5, 6.0, len(times))[:, np.newaxis]
    steps = np.arange(times.shape[1])
    peak = np.exp(-(((steps - centre[:, np.newaxis] - rng.uniform(-0.4, 0.4, (len(times), 1))) / width) ** 2))
    return 5.0 * peak - np.clip(indentations, 0.0, None) ** 1.5 * (steps < turn + 1)


@pytest.fixture(scope="module")
def page(solids, forces, model):
    bands = {"levels": LEVELS.tolist()} | {name: values.tolist() for name, values in vars(model.bands).items()}
    cases = {
        "protocols": [dict(zip(NAMES, row, strict=True)) for row in np.array([*solids.values()]).T.tolist()],
        "forces": forces.tolist(),
        "counts": list(model.counts),
        "bands": bands,
        "coverage": COVERAGE,
    }
    script = Path(__file__).with_name("numbers.mjs")
    done = subprocess.run(["node", script], input=json.dumps(cases), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_steps_are_those_of_python(page, grid, model):
    times, indentations = grid
    found = page["found"]
    np.testing.assert_allclose([one["times"] for one in found], times, rtol=1e-11)
    np.testing.assert_allclose([one["indentations"] for one in found], indentations, rtol=1e-11, atol=1e-10)
    np.testing.assert_array_equal([one["edge"] for one in found], edge_from_counts(model.counts, len(times)))


def test_results_of_forces_are_those_of_python(page, grid, forces, model):
    pull_off, instant, sharpness, work, _ = results(*grid, forces, np.array(model.counts))
    tops = [one["top"] for one in page["found"]]
    np.testing.assert_allclose([top["force"] for top in tops], pull_off, rtol=1e-9)
    np.testing.assert_allclose([top["time"] for top in tops], instant, rtol=1e-9)
    np.testing.assert_allclose([top["sharpness"] for top in tops], sharpness, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose([one["hysteresis"] for one in page["found"]], np.abs(work), rtol=1e-8)
    assert np.any(sharpness == 0.0)
    assert np.any(sharpness > 0.3)


def test_half_widths_are_those_of_python(page, solids, grid, forces, model):
    sharpness = results(*grid, forces, np.array(model.counts))[2]
    known = np.column_stack([*solids.values(), sharpness])
    expected = model.bands.widths(known, COVERAGE)
    widths = [one["widths"] for one in page["found"]]
    np.testing.assert_allclose([one["pullOff"] for one in widths], expected["pull_off"], rtol=1e-8)
    np.testing.assert_allclose([one["force"] for one in widths], expected["force"], rtol=1e-8)
    # The cases are of several groups of difficulty.
    assert len({tuple(row) for row in expected["force"]}) > 4


def test_damaged_bands_are_none(page):
    assert page["damaged"] is None
