"""Every figure and table of the paper is a target that `make help` names, and the documents name no other."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def targets():
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    listed = subprocess.run(["make", "-s", "help"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return set(re.findall(r"^  ([a-z0-9-]+) ", listed, flags=re.MULTILINE))


def test_figures_and_tables_of_the_paper_have_targets(targets):
    wanted = {f"figure-{name}" for name in (*"1234567", "architectures", "features", "fms-transfer", "learning-curves")}
    wanted |= {f"table-{name}" for name in ("protocols-dataset", "protocols-canonical", "quartiles", "persson-brener")}
    wanted |= {
        "figure-mse-mae",
        "graphical-abstract",
        "figures",
        "tables",
        "paper",
        "report",
        "smoke",
        "paper-from-scratch",
    }
    assert wanted <= targets


@pytest.mark.parametrize("name", ["REPRODUCING.md", "REPRODUCTION.md"])
def test_documents_name_targets_that_exist(name, targets):
    text = (ROOT / name).read_text(encoding="utf-8")
    assert {found for words in re.findall(r"`make ([a-z0-9 -]+?)[`(]", text) for found in words.split()} <= targets
