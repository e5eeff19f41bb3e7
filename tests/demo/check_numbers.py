"""The page's own arithmetic, that of the physical steps, against Python without a browser; run by `make test-demo`."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

import surrogate
from bem.dataset.designs import QUANTITIES
from bem.dataset.physical_steps import physical_grid
from surrogate.data.features import edge_from_counts

NAMES = (*QUANTITIES, "modulus_ratio")


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


def test_steps_are_those_of_python(solids, model):
    protocols = [dict(zip(NAMES, row, strict=True)) for row in np.array([*solids.values()]).T.tolist()]
    script = Path(__file__).with_name("numbers.mjs")
    cases = json.dumps({"protocols": protocols, "counts": list(model.counts)})
    done = subprocess.run(["node", script], input=cases, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    histories = json.loads(done.stdout)
    times, indentations = physical_grid(**solids, counts=model.counts)
    np.testing.assert_allclose([row["times"] for row in histories], times, rtol=1e-11)
    np.testing.assert_allclose([row["indentations"] for row in histories], indentations, rtol=1e-11, atol=1e-10)
    np.testing.assert_array_equal([row["edge"] for row in histories], edge_from_counts(model.counts, len(times)))
