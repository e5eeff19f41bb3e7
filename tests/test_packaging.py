"""The wheel holds both packages and the published model, and predicts far from the repository."""

import json
import os
import re
import shutil
import zipfile
from collections import Counter
from email.parser import Parser
from pathlib import Path

import pytest

from surrogate.files import PUBLISHED
from surrogate.files import PUBLISHED_PRETRAINED as PRETRAINED
from tests.processes import ROOT, python

FILES = ("model.onnx", "scaling.json", "bands.npz", "run.json")
MOST_MODULES = 16  # in a folder
MODEL = {"model.onnx", "model.weights.h5", "run.json", "scaling.json", "metrics.json", "split.json"}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    source = tmp_path_factory.mktemp("source")
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source / name)
    for name in ("bem", "surrogate", "experiments", "paper_figures"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(PUBLISHED / "M1-concat", source / "published" / "models" / "M1-concat")
    shutil.copy(PUBLISHED / "split.json", source / "published" / "models")
    shutil.copytree(PRETRAINED, source / "published" / "pretrained")
    build = "from setuptools.build_meta import build_wheel; build_wheel('dist')"  # what pip calls
    python("-c", build, cwd=source, check=True)
    (built,) = (source / "dist").glob("*.whl")
    return built


@pytest.fixture(scope="module")
def site(wheel, tmp_path_factory):
    """The wheel, unpacked as an installation would."""
    folder = tmp_path_factory.mktemp("site")
    zipfile.ZipFile(wheel).extractall(folder)
    return folder


def isolated(site, code, cwd, **environment):
    """Run code that sees the unpacked wheel before the repository's own packages."""
    code = f"import sys; sys.path.insert(0, {str(site)!r})\n{code}"
    result = python("-I", "-c", code, cwd=cwd, env=os.environ | environment)
    assert result.returncode == 0, result.stderr
    return result.stdout.strip()


def test_wheel_holds_packages_and_model(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    packaged = {name.rpartition("/")[2] for name in names if name.startswith("surrogate/models/M1-concat/")}
    assert packaged == MODEL
    assert {
        "bem/py.typed",
        "bem/simulation.py",
        "bem/_support/outputs.py",
        "surrogate/py.typed",
        "surrogate/model.py",
        "surrogate/training/recipes/swift.toml",
    } <= names
    assert {name.partition("/")[0] for name in names if ".dist-info/" not in name} == {"bem", "surrogate"}


def test_wheel_size_equals_the_documents(wheel):
    stated = re.search(r"about (\d+) MB of\s+wheel", (ROOT / "docs" / "install.md").read_text(encoding="utf-8"))
    assert round(wheel.stat().st_size / 1e6) == int(stated[1])


def test_metadata_have_extras_and_ranges(site):
    (path,) = site.glob("*.dist-info/METADATA")
    metadata = Parser().parsestr(path.read_text(encoding="utf-8"))
    assert {"train", "cluster", "lab", "tables", "peers"} == set(metadata.get_all("Provides-Extra"))
    required = [line.replace('"', "'") for line in metadata.get_all("Requires-Dist")]
    # An exact version would forbid installing this beside other packages. The software of a published comparison is
    # pinned all the same: the lock leaves it out, and only who asks for that extra gets it.
    exact = [line for line in required if "==" in line.partition(";")[0]]
    assert exact == [line for line in required if "extra == 'peers'" in line]
    assert any(line.startswith("tensorflow") and "extra == 'train'" in line for line in required)
    assert any(line.startswith("onnxruntime") and "extra" not in line for line in required)


OTHERS = sorted({path.name for path in PRETRAINED.glob("*")} - {"fast"})


@pytest.mark.parametrize(
    "name", ["fast", *(pytest.param(model, marks=pytest.mark.slow) for model in ("M1-concat", *OTHERS))]
)
def test_installation_predicts_from_anywhere(site, tmp_path, name):
    files = {path.name for path in (site / "surrogate" / "models" / name).iterdir()}
    assert files >= {"M1-concat": MODEL}.get(name, {"run.json", "stages.npz", "intervals.npz"})
    printed = isolated(
        site,
        "import surrogate\n"
        "from bem import LoadingProtocol, Scene, StandardLinearSolid\n"
        "protocol = LoadingProtocol(peak_indentation=20, loading_rate=10, dwell_time=1, unloading_rate=10)\n"
        f"one = surrogate.load({name!r}).predict(Scene(1.0, StandardLinearSolid(0.1)), protocol)\n"
        "print(surrogate.__file__, *(one.pull_off_interval or (1.0, 20.0)), one.pull_off_force)",
        tmp_path,
        # Its place is new, so that kernels would be compiled; the slow ones do.
        NUMBA_DISABLE_JIT="1" if name == "fast" else "0",
    )
    path, *numbers = printed.rsplit(" ", 3)
    low, high, force = map(float, numbers)
    assert Path(path) == site / "surrogate" / "__init__.py"
    assert 1.0 <= low < force < high <= 20.0


COMMANDS = """
import importlib.util
importlib.util.find_spec = lambda *_: None
from surrogate.cli.app import app_main
for words in ("list", "export M1-concat --out copy.onnx"):
    sys.argv = ["surrogate", *words.split()]
    try:
        app_main()
    except SystemExit as end:
        assert not end.code, end.code
"""
"""Without Keras, as in a plain installation."""


def test_commands_find_the_packaged_model(site, tmp_path):
    assert re.search(r"^M1-concat +473,729 +\d", isolated(site, COMMANDS, tmp_path), flags=re.MULTILINE)
    packaged = site / "surrogate" / "models" / "M1-concat" / "model.onnx"
    assert (tmp_path / "copy.onnx").read_bytes() == packaged.read_bytes()


def test_image_holds_no_ignored_file():
    ignored = {line.strip("/") for line in (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines()}
    left_out = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    assert ignored <= {line.removeprefix("**/") for line in left_out}


def test_dev_container_is_a_stage_of_image():
    text = (ROOT / ".devcontainer" / "devcontainer.json").read_text(encoding="utf-8")
    settings = json.loads(re.sub(r"^\s*//.*", "", text, flags=re.MULTILINE))
    image = (ROOT / ".devcontainer" / settings["build"]["dockerfile"]).read_text(encoding="utf-8")
    assert settings["build"]["target"] in re.findall(r"^FROM \S+ AS (\S+)", image, flags=re.MULTILINE)


def test_no_folder_outgrows_the_eye():
    packages = ("bem", "surrogate", "experiments", "paper_figures")
    modules = [path for package in packages for path in (ROOT / package).rglob("*.py") if path.name != "__init__.py"]
    folders = Counter(str(path.parent.relative_to(ROOT)) for path in modules)
    assert {folder: count for folder, count in folders.items() if count > MOST_MODULES} == {}
