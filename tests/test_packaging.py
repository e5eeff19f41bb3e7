"""The wheel holds the published model and finds it far from the repository."""

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    source = tmp_path_factory.mktemp("source")
    for name in ("pyproject.toml", "setup.py", "MANIFEST.in", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source / name)
    for name in ("bem", "surrogate"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    model = source / "published" / "models" / "M1-concat"
    model.mkdir(parents=True)
    for name in ("model.onnx", "model.weights.h5", "run.json", "scaling.json", "metrics.json", "history.csv"):
        (model / name).write_text("{}")
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    subprocess.run([*command, "--wheel-dir", source / "dist", source], check=True, capture_output=True)
    (built,) = (source / "dist").glob("*.whl")
    return built


@pytest.mark.slow
def test_the_wheel_holds_the_published_model(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    packaged = {name.rpartition("/")[2] for name in names if name.startswith("surrogate/models/M1-concat/")}
    assert packaged == {"model.onnx", "model.weights.h5", "run.json", "scaling.json", "metrics.json"}
    assert {"bem/simulate.py", "surrogate/predictor.py", "surrogate/recipes/swift.toml"} <= names
    assert not any(name.startswith(("tests", "published", "demo")) for name in names)


@pytest.mark.slow
def test_an_installation_finds_it_from_anywhere(wheel, tmp_path):
    zipfile.ZipFile(wheel).extractall(tmp_path / "site")
    code = (
        f"import sys; sys.path.insert(0, {str(tmp_path / 'site')!r})\n"
        "from surrogate.model_files import find_model\n"
        "print(find_model('M1-concat'))"
    )
    # Isolated, so that neither the working directory nor the repository's own packages are seen first.
    result = subprocess.run(
        [sys.executable, "-I", "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert Path(result.stdout.strip()) == tmp_path / "site" / "surrogate" / "models" / "M1-concat"
