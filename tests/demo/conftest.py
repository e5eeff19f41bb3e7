import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import surrogate
from tests.processes import ROOT

DIST = ROOT / "demo" / "dist"
OUT = Path(os.environ.get("DEMO_OUT", ROOT / "results" / "demo"))


@pytest.fixture(scope="session")
def browsed():
    """What the driver saw, in the folder it left screenshots and downloads in."""
    shutil.rmtree(OUT, ignore_errors=True)
    OUT.mkdir(parents=True)
    chromium = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    assert chromium, "Chromium is missing; install it, or name it in CHROMIUM"
    driver = Path(__file__).with_name("drive.mjs")
    done = subprocess.run(
        ["node", str(driver), str(DIST), str(OUT), chromium, sys.executable],
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads((OUT / "seen.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def folder():
    return OUT


@pytest.fixture(scope="session")
def curves():
    return json.loads((DIST / "curves.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def model():
    return surrogate.load(DIST / "model.onnx")


@pytest.fixture(scope="session")
def fast():
    return surrogate.load("fast")


@pytest.fixture(scope="session")
def solids():
    return json.loads((DIST / "solids.json").read_text(encoding="utf-8"))["curves"]
