"""What is heavy loads only when it is needed."""

import os
import subprocess
import sys

from tests.processes import ROOT

HEAVY = {"numpy", "numba", "scipy", "h5py", "joblib", "rich", "matplotlib", "tensorflow", "keras"}
SIMULATED = """
from bem import LoadingProtocol, Scene, simulate
simulate(Scene(tabor=1.0), LoadingProtocol(peak_indentation=2.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0))
"""


def loaded_by(source, **environment):
    code = f"{source}\nimport sys\nprint(*{{name.partition('.')[0] for name in sys.modules}})"
    options = {"capture_output": True, "text": True, "check": True, "env": os.environ | environment}
    return set(subprocess.run([sys.executable, "-c", code], **options).stdout.split())


def test_imports_load_nothing_heavy():
    assert not loaded_by("import bem.cli.app") & HEAVY


def test_simulation_loads_few_modules():
    assert not loaded_by(SIMULATED) & {"h5py", "joblib", "matplotlib", "tensorflow", "keras"}
    source = "from bem import *; import surrogate, surrogate.cli.app; surrogate.names()"
    assert not loaded_by(source) & {"tensorflow", "keras"}


def test_reading_data_sets_compiles_nothing(tmp_path):
    path = ROOT / "published" / "dataset.h5"
    read = f"from surrogate.data.dataset import TrajectoryDataset; TrajectoryDataset.load({str(path)!r})"
    assert not loaded_by(read, NUMBA_CACHE_DIR=str(tmp_path)) & {"keras", "tensorflow", "joblib", "matplotlib"}
    assert not [file for file in tmp_path.rglob("*") if file.is_file()]
