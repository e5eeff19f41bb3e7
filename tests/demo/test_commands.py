import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_no_model_is_a_failure():
    script = ROOT / "tests" / "demo" / "run.sh"
    done = subprocess.run([script, "no/such.onnx"], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("The demonstrator cannot be tested: no/such.onnx is missing; export it with")


def test_serving_needs_no_environment():
    planned = subprocess.run(["make", "--dry-run", "demo"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert "http.server" in planned
    assert ".venv" not in planned
