import sys
from pathlib import Path

import numpy as np
import pytest

from bem.campaign_files import verify
from bem.dataset_file import load_dataset
from bem.records import SCALARS
from tests.data_files import editing

sys.path.insert(0, str(Path(__file__).parent))

import campaign_stand_in as stand_in
from campaign_helpers import altered, put


def test_verify_computes_a_sample_again(undisturbed, tmp_path):
    found = verify(undisturbed, sample=10, seed=0, solver=stand_in.solve)
    assert found.agrees
    assert found.identical == len(found.indices) == 10

    def shift(file):
        file["fms/force"][:, 60] += np.float32(0.1)

    def misplace(file):
        file["protocols/tabor"][3] = 1.234

    assert not verify(altered(undisturbed, tmp_path, shift), sample=10, seed=0, solver=stand_in.solve).agrees
    with pytest.raises(ValueError, match="protocols must be those of the design"):
        verify(altered(undisturbed, tmp_path, misplace), solver=stand_in.solve)


def test_verify_knows_protocols_of_another_processor_by_all_but_their_last_digits(undisturbed, tmp_path):
    def nudge(file):
        for name in ("dwell_time", "peak_indentation"):
            file[f"protocols/{name}"][...] = np.nextafter(file[f"protocols/{name}"][...], np.inf)

    assert verify(altered(undisturbed, tmp_path, nudge), sample=10, seed=0, solver=stand_in.solve).agrees


def test_verify_asks_another_build_for_the_accuracy_and_the_same_build_for_rounding(undisturbed, tmp_path):
    nudged = tmp_path / "nudged.h5"
    nudged.write_bytes(undisturbed.read_bytes())
    with editing(nudged) as file:
        file["fms/force"][...] *= np.float32(1.0 + 1e-4)
    assert not verify(nudged, sample=10, seed=0, solver=stand_in.solve).agrees
    with editing(nudged) as file:
        file.attrs["host"] = "Linux x86_64, 8 cores of Another Processor"
    found = verify(nudged, sample=10, seed=0, solver=stand_in.solve)
    assert found.agrees
    assert not found.same_build
    with editing(nudged) as file:
        file["fms/force"][:, 60] += np.float32(0.1)
    assert not verify(nudged, sample=10, seed=0, solver=stand_in.solve).agrees


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("fms/force", 0.0),
        *((f"scalars/{name}", 1.25) for name, kind in SCALARS.items() if kind is np.float64 and "seconds" not in name),
        *((f"scalars/{name}", 99) for name, kind in SCALARS.items() if kind is np.int32),
        ("jumps/time", 1e-9),
        ("jumps/force_after", 77.0),
        ("native/contact_radius", 1e9),
        ("reason", "because"),
    ],
)
def test_verify_compares_every_column(name, value, undisturbed, tmp_path):
    path = altered(undisturbed, tmp_path, put(name, value))
    found = verify(path, sample=120, solver=stand_in.solve, workers=1)
    assert found.same_build
    assert not found.agrees
    jumping = name.startswith("jumps/")
    assert found.identical == (np.sum(load_dataset(path).scalars["jump_count"] == 0) if jumping else 0)
    assert len(found.bad) == 120 - found.identical


def test_verify_leaves_the_seconds_alone(undisturbed, tmp_path):
    path = altered(undisturbed, tmp_path, put("scalars/solver_seconds", 5.0))
    found = verify(path, sample=20, solver=stand_in.solve, workers=1)
    assert (found.agrees, found.identical) == (True, 20)


def test_another_build_may_step_otherwise_but_not_result_in_nothing(undisturbed, tmp_path):
    def change(file):
        file.attrs["host"] = "Linux x86_64, 8 cores of Another Processor"
        file["scalars/steps"][...] += 1

    found = verify(altered(undisturbed, tmp_path, change), sample=5, solver=stand_in.solve, workers=1)
    assert (found.agrees, found.identical) == (True, 0)

    def empty(file):
        change(file)
        file["scalars/hysteresis"][...] = 0.0

    assert not verify(altered(undisturbed, tmp_path, empty), sample=5, solver=stand_in.solve, workers=1).agrees
