import re
import subprocess

from bem.results.plots import COLOURS, PULL_OFF
from tests.processes import ROOT


def test_no_model_is_a_failure():
    script = ROOT / "tests" / "demo" / "run.sh"
    done = subprocess.run([script, "no/such.onnx"], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("The demonstrator cannot be tested: no/such.onnx is missing; export it with")


def test_tool_colours_equal_those_of_figures():
    styles = (ROOT / "demo" / "src" / "styles.css").read_text(encoding="utf-8")
    light = dict(re.findall(r"--(\w+): (#\w{6});", styles.partition("@media")[0]))
    tools = ("solver", "M1", "fast")
    assert {name: light[name].upper() for name in tools} == {name: COLOURS[name] for name in tools}
    assert light["peak"].upper() == PULL_OFF


def test_serving_needs_no_environment():
    planned = subprocess.run(["make", "--dry-run", "demo"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert "python3 -m http.server --bind 127.0.0.1 --directory demo/dist 8000" in planned
    assert ".venv" not in planned
