"""Every figure and table of the paper is a target that `make help` names, and the documents name no other."""

import os
import re
import shutil
import subprocess
import time
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
        "model-paper-recipe",
        "model-large",
        "model-budgets",
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


def commands(*words):
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    done = subprocess.run(["make", "-n", *words], cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.replace("\\\n", "")


def test_models_beside_the_eighteen_are_trained_by_their_own_recipes_and_labels(tmp_path):
    (tmp_path / "dataset.h5").touch()
    lines = commands("more-models", f"OUT={tmp_path}/out", f"PUBLISHED={tmp_path}", "-o", f"{tmp_path}/dataset.h5")
    campaign = re.search(r"bem campaign .*--out \S+/out/dataset/extra\.h5", lines)[0]
    assert "--design paper --seed 1 --count 112050" in campaign
    trained = {
        label: " ".join(rest.split(" --dataset")[0].split())
        for label, rest in re.findall(r"surrogate train M1-concat --label (\S+) (.*)", lines)
    }
    assert trained == {
        "M1-concat-paper": "--recipe paper",
        "M1-concat-8-epochs": "--recipe swift --epochs 8",
        "M1-concat-15-epochs": "--recipe swift --epochs 15",
        "M1-concat-large": f"--recipe swift --extra {tmp_path}/out/dataset/extra.h5 --epochs 10",
    }


STUDIES = (
    "canonical_regimes",
    "persson_brener",
    "error_statistics",
    "fms_transfer",
    "model_comparison",
    "architecture_graphs",
    "adopted_settings",
    "paper_slips",
)


@pytest.mark.parametrize(
    ("touched", "studies"),
    [
        ("published/models/M1-concat/test_errors.csv", {"error_statistics"}),
        ("published/models/M1-concat/split.json", {"error_statistics", "fms_transfer", "model_comparison"}),
        ("published/models/M1-concat/history.csv", {"model_comparison"}),
        ("surrogate/metrics.py", {"canonical_regimes", "persson_brener", "fms_transfer", "architecture_graphs"}),
        ("surrogate/cli.py", set()),
        ("paper_figures/paper_values/canonical_protocols.csv", {"canonical_regimes", "fms_transfer", "paper_slips"}),
        ("README.md", set()),
    ],
)
def test_touching_an_input_redoes_what_reads_it(touched, studies, tmp_path):
    (tmp_path / "studies").mkdir()
    future = time.time() + 1e6
    for name in STUDIES:
        path = tmp_path / "studies" / f"{name}.json"
        path.touch()
        os.utime(path, (future, future))
    redone = set(re.findall(r"-m experiments\.(\w+) ", commands("studies", f"OUT={tmp_path}", "-W", touched)))
    assert redone - {"architecture_graphs", "adopted_settings"} == studies - {"architecture_graphs"}


def test_a_part_of_the_data_set_is_not_published(tmp_path):
    def refused(*words):
        command = ["make", "-s", "only-all-is-published", *words]
        return "only all 12450" in subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False).stderr

    assert not refused()
    assert not refused("COUNT=5", f"PUBLISHED={tmp_path}/published")
    for published in ("published", "./published", ROOT / "published"):
        assert refused("COUNT=5", f"PUBLISHED={published}")
