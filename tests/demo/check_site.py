"""Pages of the documentation against axe-core in headless Chromium; run by `make test-demo`."""

import json
import os
import shutil

import pytest

from tests.processes import ROOT, ended, python

PAGES = ("", "simulate", "gallery/1_first_trajectory", "report", "api/bem.simulation.simulate")
"""The front page, a page of the guide, a tutorial, the report, and an entry of the API."""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the site, whose tutorials are shown without results."""
    pytest.importorskip("mkdocs", reason="MkDocs builds the site; `make setup` installs it")
    folder = tmp_path_factory.mktemp("site")
    arguments = ("-m", "mkdocs", "build", "--config-file", ".mkdocs.yml", "--strict", "--quiet", "--site-dir", folder)
    result = python(*arguments, cwd=ROOT, env=os.environ | {"RUN_TUTORIALS": "false"})
    assert result.returncode == 0, result.stdout + result.stderr
    return folder


def test_pages_have_no_serious_finding(site):
    chromium = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    if not chromium:
        pytest.skip("Chromium is missing; install it, or name it in CHROMIUM")
    if not (ROOT / "demo/node_modules/axe-core").is_dir():
        pytest.skip("axe-core is missing; `make demo-build` installs it")
    files = [str(site / page / "index.html") for page in PAGES]
    done = ended("node", str(ROOT / "tests/demo/site.mjs"), chromium, *files, timeout=240)
    assert done.returncode == 0, done.stdout + done.stderr
    # Both schemes were seen: a page that ignores the browser's wish would be judged twice in one.
    assert json.loads(done.stdout) == {file: {"default": [], "slate": []} for file in files}
