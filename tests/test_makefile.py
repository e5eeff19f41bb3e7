"""The targets of the Makefile: what they are named, what they run, what they are made from, and what they refuse."""

import os
import re
import shutil
import subprocess

import pytest

from experiments.__main__ import studies
from paper_figures.__main__ import captions, modules
from tests.processes import ROOT, ended

pytestmark = pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")


def make(*arguments, check=True):
    return ended("make", "--no-print-directory", *arguments, cwd=ROOT, check=check)


def commands(*arguments):
    """The commands that make would run."""
    return make("-n", *arguments).stdout.replace("\\\n", "")


@pytest.fixture(scope="module")
def targets():
    return set(re.findall(r"^  ([a-z0-9-]+) ", make("-s", "help-all").stdout, flags=re.MULTILINE))


def test_targets_keep_their_names(targets):
    """Those of figures and tables are the names of their modules."""
    assert captions().keys() <= targets
    assert modules().keys() == captions().keys()
    expected = """setup setup-small verify paper figures tables report cost-figures studies dataset models measure-speed
        model-paper-recipe paper-recipe-seeds model-as-worded model-inputs-c model-large model-budgets more-models
        pretrained judge-fast judge-accurate feature-sets data-efficiency ranking model-forces threshold
        equal-parameters cards paper-from-scratch smoke measurements test test-slow test-emulated test-torch
        test-minima lint format golden-trajectories lock clean docs docs-numbers readme-pictures demo demo-build
        test-demo demo-curves demo-models demo-card help help-all"""
    assert targets - captions().keys() == set(expected.split())


def test_help_is_one_screen(targets):
    shown = make("-s", "help").stdout
    first, *groups = re.split(r"^\S.*$", shown, flags=re.MULTILINE)[2:-1]
    described = re.findall(r"^  (\S+)  ", first, flags=re.MULTILINE)
    assert described[0] == "setup"
    assert len(shown.splitlines()) <= 30
    assert {name for group in groups for name in group.split()} | set(described) == targets | {"measure-%"}


@pytest.mark.parametrize("pages", ["*.md", "docs/*.md", "bem/*.md"])
def test_documents_name_existing_targets(pages, targets):
    for page in set(ROOT.glob(pages)) - {ROOT / "CHANGELOG.md"}:
        text = page.read_text(encoding="utf-8")
        for target in {
            name for line in re.findall(r"`make (?:-j2 )?([a-z0-9 -]+?)[`(]", text) for name in line.split()
        }:
            study = target.removeprefix("measure-").replace("-", "_")
            assert target in targets or (target.startswith("measure-") and study in studies()), f"{page}: make {target}"
        assert set(re.findall(r"`(?:\.venv/bin/)?python -m experiments ([a-z_]+)", text)) <= studies().keys(), page


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """Words for make with which all studies, figures and tables are made, as empty files."""
    folder = tmp_path_factory.mktemp("drawn")
    for name in ("venv", "out/figures", "out/tables", "out/studies"):
        (folder / name).mkdir(parents=True)
    (folder / "venv/.installed").touch()
    arguments = ["studies", "figures", "tables", "cost-figures", f"VENV={folder}/venv", f"OUT={folder}/out"]
    arguments += ["-o", f"{folder}/venv/.installed"]
    published = set((ROOT / "published").rglob("*"))
    make("--touch", *arguments)
    # Where a published file is missing, make would leave an empty one.
    for path in (made := set((ROOT / "published").rglob("*")) - published):
        path.unlink()
    assert not made
    return arguments


@pytest.mark.parametrize(
    ("changed", "again", "spared"),
    [
        (
            "bem/methods/version.py",
            "dataset_examples persson_brener figure-1 figure-5",
            "model_comparison table-models",
        ),
        ("published/dataset.h5", "dataset_statistics error_statistics figure-2 figure-7", "dataset_examples figure-1"),
        ("published/models/M4-FiLM/run.json", "model_comparison figure-5 figure-mse-mae", "error_statistics figure-7"),
        ("published/data_efficiency.json", "figure-5 figure-features", "model_comparison figure-2"),
        ("published/measurements/peers.json", "figure-peers table-peers", "dataset_statistics figure-1 figure-effects"),
        ("experiments/paper/persson_brener.py", "persson_brener figure-5", "fms_transfer figure-6"),
        ("experiments/paper_values/quartiles.csv", "inconsistencies error_statistics", "figure-peers figure-effects"),
        ("paper_figures/style/drawing.py", "figure-1 table-models figure-peers", "model_comparison dataset_examples"),
    ],
)
def test_changed_file_remakes_its_products(changed, again, spared, drawn):
    made = re.findall(r"-m (?:experiments|paper_figures) (\S+)", commands(*drawn, "-W", changed))
    assert set(again.split()) <= set(made)
    assert not set(spared.split()) & set(made)


@pytest.mark.parametrize("more", [[], ["-W", "bem/cli/app.py"]])
def test_nothing_is_remade_without_a_reason(more, drawn):
    assert not re.findall(r"-m (?:experiments|paper_figures) (\S+)", commands(*drawn, *more))


def test_studies_of_the_report_read_no_clock():
    for path in (*(ROOT / "experiments/paper").glob("*.py"), *(ROOT / "paper_figures").glob("*/*.py")):
        source = path.read_text(encoding="utf-8")
        assert not re.search(r"perf_counter|process_time|\bCLOCK\b|\btimed\(|stats\.seconds", source), path.name


def test_other_models_keep_recipe_and_label(tmp_path):
    lines = " ".join(commands("more-models", f"OUT={tmp_path}/out", f"PUBLISHED={tmp_path}").split())
    campaign = re.search(r"bem campaign .*--out \S+/out/dataset/extra\.h5", lines)[0]
    assert "--design paper --seed 1 --count 112050" in campaign
    assert dict(re.findall(r"surrogate train M1-concat --label (\S+) (.*?) --dataset", lines)) == {
        "M1-concat-paper": "--recipe paper",
        "M1-concat-8-epochs": "--recipe swift --epochs 8",
        "M1-concat-15-epochs": "--recipe swift --epochs 15",
        "M1-concat-60-epochs": "--recipe swift --epochs 60",
        "M1-concat-inputs-C": "--recipe swift --features C",
        "M1-concat-large": f"--recipe swift --features C --extra {tmp_path}/out/dataset/extra.h5 --epochs 5",
    }
    another = commands("model-paper-recipe", "MODEL=M3-FiLM", f"PUBLISHED={tmp_path}")
    assert "surrogate train M3-FiLM --label M3-FiLM-paper --recipe paper " in another
    eighteen = commands("models", "MODEL=M3-FiLM", "ONLY=M1-FiLM", "RECIPE=paper", f"PUBLISHED={tmp_path}")
    assert "surrogate train M1-FiLM --label M1-FiLM-paper --recipe paper " in eighteen
    worded = commands("model-as-worded", f"PUBLISHED={tmp_path}")
    assert "surrogate train M1-concat --label M1-concat-as-worded --recipe paper-as-worded " in worded


def test_measurement_keeps_its_file_name(tmp_path):
    lines = commands("measure-gradients", "measure-canonical-times", f"PUBLISHED={tmp_path}", "BUSY=yes")
    inputs = {"gradients": "", "canonical_times": f"experiments/configs/canonical_times.toml {tmp_path}/models"}
    for name, paths in inputs.items():
        file = f"{tmp_path}/measurements/{name}.json"
        assert f"-m experiments {name} {paths} --out {file} --busy" in lines
        assert f"' sums {file}" in lines


def test_only_paper_target_leaves_out():
    output = commands("paper", "cost-figures", "-B")
    for name in ("figure-1", "figure-ranking", "table-ranking"):
        assert re.search(rf"-m paper_figures {name} .* --out \S+ --leave-out\n", output)
        assert "--leave-out" not in commands("-B", name)
    graphs = "results/studies/architecture_graphs.json"
    assert f"-m experiments architecture_graphs  --out {graphs} --leave-out" in output
    report = commands("-B", "report")
    assert "-m experiments adopted_settings" in report
    assert "--leave-out" not in report


@pytest.mark.parametrize("status", [0, 75])
def test_models_are_trained_two_at_a_time(status, tmp_path):
    """Programs stand in for Python and `surrogate`, which publishes once the other training has begun, too."""
    (tmp_path / "bin").mkdir()
    begun = f"[ -e {tmp_path}/M1-FiLM -a -e {tmp_path}/M1-concat ]"
    both = f"for _ in $(seq 200); do {begun} && break; sleep 0.05; done; {begun} || exit 9"
    train = f"touch {tmp_path}/$2; {both}; mkdir -p {tmp_path}/models/$2; exit {status}"
    for name, script in (("surrogate", train), ("python", f'echo "$@" >> {tmp_path}/noted')):
        (tmp_path / "bin" / name).write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
        (tmp_path / "bin" / name).chmod(0o755)
    (tmp_path / "models" / "M4-FiLM").mkdir(parents=True)
    for file in (".installed", "dataset.h5", "models/M4-FiLM/run.json"):
        (tmp_path / file).touch()
    script = [f"VENV={tmp_path}", f"PUBLISHED={tmp_path}", "-o", f"{tmp_path}/.installed"]
    done = make("-s", "-j2", "models", "ONLY=M1-FiLM M1-concat M4-FiLM", *script, check=False)
    assert done.returncode == (2 if status else 0)
    assert (f"Error {status}" in done.stderr) == (status != 0)
    assert not (tmp_path / "M4-FiLM").exists()
    noted = "" if status else 3 * f"-m experiments.run_folders {tmp_path}/models\n"
    assert ((tmp_path / "noted").read_text(encoding="utf-8") if noted else "") == noted
    assert (tmp_path / "SHA256SUMS").exists() == (not status)


def test_partial_data_set_is_not_published(tmp_path):
    def refused(*arguments):
        return "only all 12450" in make("-s", "require-full-dataset", *arguments, check=False).stderr

    assert not refused()
    assert not refused("COUNT=5", f"PUBLISHED={tmp_path}/published")
    (tmp_path / "repository").symlink_to(ROOT)
    for published in ("published", "./published", tmp_path / "repository/published"):
        assert refused("COUNT=5", f"PUBLISHED={published}")


@pytest.fixture
def python(tmp_path):
    """A program that stands in for Python and `bem`: it makes an environment of itself, and says what pip is asked."""
    python = tmp_path / "python"
    copies = 'mkdir -p "$3/bin" && cp "$0" "$3/bin/python" && cp "$0" "$3/bin/bem" && cp "$0" "$3/bin/surrogate"'
    script = f'[ "$2" != venv ] || {{ {copies}; }}; [ "$2" != pip ] || echo "$@"'
    python.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    python.chmod(0o755)
    return python


def test_setup_announces_its_steps(python, tmp_path):
    first, *logs = make("setup", f"VENV={tmp_path}/venv", f"PYTHON={python}").stdout.splitlines()
    packages = len(
        re.findall(r"^\S+==", (ROOT / "requirements/work.lock").read_text(encoding="utf-8"), flags=re.MULTILINE)
    )
    assert first.startswith(f"Step 1 of 2: installing {packages} packages into {tmp_path}/venv, 3 GB: 3 to 10 minutes")
    assert logs[0].startswith("-m pip install --disable-pip-version-check --require-hashes")  # which shows its progress
    assert logs[-2] == f"Step 2 of 2: {tmp_path}/venv/bin/bem compile"
    assert re.fullmatch(rf"{tmp_path}/venv is ready, \S+", logs[-1])


@pytest.mark.parametrize("fails", [False, True])
def test_on_a_terminal_packages_are_counted(fails, python, tmp_path):
    """What pip prints is kept back, unless it fails."""
    pip = 'echo "Collecting a"; sleep 1.5' + ("; exit 3" if fails else "")
    python.write_text(python.read_text(encoding="utf-8").replace('echo "$@"', f"{{ {pip}; }}"), encoding="utf-8")
    (tmp_path / "scratch").mkdir()
    reader, terminal = os.openpty()
    arguments = ("make", "setup", f"VENV={tmp_path}/venv", f"PYTHON={python}")
    environment = os.environ | {"TMPDIR": f"{tmp_path}/scratch"}
    done = subprocess.run(arguments, cwd=ROOT, env=environment, stdout=terminal, stderr=terminal, check=False)
    printed = os.read(reader, 10_000).decode()
    assert (done.returncode != 0) == fails
    assert re.search(r"\r  1 of \d+ downloaded, 0 installed, \d+ s left", printed)
    assert ("ready" in printed) != fails
    assert not list((tmp_path / "scratch").iterdir())


def test_small_setup_stays_small(python, tmp_path):
    def run(*targets):
        return make(*targets, f"VENV={tmp_path}/venv", f"PYTHON={python}").stdout

    def refused(*targets):
        with pytest.raises(subprocess.CalledProcessError) as caught:
            run(*targets)
        return caught.value.stderr

    small = run("setup-small")
    assert "1 GB: 1 to 3 minutes" in small
    assert "--require-hashes --requirement requirements/use.lock\n" in small
    assert "--require-hashes" not in run("setup-small")  # once is enough
    # A newer Python, which has no full installation, keeps the small one.
    own = tmp_path / "venv" / "bin" / "python"
    own.write_text('#!/bin/sh\n[ "$1" != -c ]\n', encoding="utf-8")
    assert "make setup needs Python 3.11 or 3.12" in refused("setup")
    shutil.copy(python, own)
    assert "--require-hashes --requirement requirements/work.lock\n" in run("setup")
