import importlib.util
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from bem.dataset.file import load_dataset
from paper_figures.figures import figure_2
from paper_figures.report import reproducibility
from paper_figures.style import drawing

PATH = Path(__file__).resolve().parents[2] / "tools/fill.py"
specification = importlib.util.spec_from_file_location("fill", PATH)
fill = importlib.util.module_from_spec(specification)
specification.loader.exec_module(fill)


def test_places_are_filled_and_stay_places():
    once = fill.filled("a <!-- count -->?<!-- end --> b", {"count": "3"})
    assert once == "a <!-- count -->3<!-- end --> b"
    assert fill.filled(once, {"count": "4"}) == "a <!-- count -->4<!-- end --> b"


def test_the_cost_of_the_data_set_is_the_solvers_as_in_figure_2():
    values = fill.of_dataset(PATH.parents[1] / "published")
    dataset = load_dataset(PATH.parents[1] / "published/dataset.h5")
    (drawn,) = drawing.figure(height=2.0).subplots(1, 1, squeeze=False).flat
    figure_2.draw_cost(drawn, dataset, drawing.paper_values("dataset"))
    assert any(f"here: {values['core-minutes']} min" in text.get_text() for text in drawn.texts)
    each = 1e3 * 60.0 * float(values["core-minutes"]) / int(values["trajectories"].replace(",", ""))
    assert each == pytest.approx(float(values["milliseconds"]), rel=0.05)


def test_the_cost_in_the_readme_is_the_present_solvers_and_less_than_that_of_the_data_set():
    published = PATH.parents[1] / "published"
    price, dataset = fill.of_price(published), fill.of_dataset(published)
    seconds, each = float(price["core-seconds"]), float(price["milliseconds each"])
    assert each == pytest.approx(1e3 * seconds / int(dataset["trajectories"].replace(",", "")), rel=0.05)
    assert seconds < 60.0 * float(dataset["core-minutes"])


def test_an_unknown_place_is_refused():
    with pytest.raises(ValueError, match="received 'other'"):
        fill.filled("<!-- other -->?<!-- end -->", {"count": "3"})


def test_blocks_and_places_are_filled_in_the_same_way():
    text = "<!-- a -->\nold\n<!-- /a --> and <!-- b -->old<!-- end -->"
    once = fill.filled(text, {"a": "new", "b": "1"})
    assert once == "<!-- a -->\n\nnew\n\n<!-- /a --> and <!-- b -->1<!-- end -->"
    assert fill.filled(once, {"a": "new", "b": "1"}) == once


def test_the_table_of_targets_comes_from_the_registry(tmp_path):
    measured = {"host": "Some Processor", "minutes": {"figure-1": 0.34, "figures tables": 4.0}}
    (tmp_path / "measurements").mkdir()
    (tmp_path / "measurements" / "target_minutes.json").write_text(json.dumps(measured), encoding="utf-8")
    found = fill.of_targets(tmp_path)
    rows = {row.split("`")[1]: row.split(" | ") for row in found["targets"].splitlines()[2:]}
    assert rows["make figure-1"][2:] == ["solver", "0.3", "- |"]
    assert rows["make figures tables"][3] == "4.0"
    assert rows["make figure-7"][2:4] == ["data set, M1-concat", "-"]
    assert rows["make figure-7"][4].endswith(" e |")
    assert found["machine"] == "Some Processor"


def test_the_guide_shows_the_seconds_that_are_published_or_says_that_none_are(tmp_path):
    content = {"host": "Some Processor", "model": "M1-concat", "steps": 200, "share_above_50_microseconds": 0.0}
    content["microseconds"] = {"median": 31.0, "p99": 40.0, "p99_9": 45.0, "worst": 90.0}
    (tmp_path / "measurements").mkdir()
    (tmp_path / "measurements" / "stream_latency.json").write_text(json.dumps(content), encoding="utf-8")
    page = (PATH.parents[1] / "docs" / "control.md").read_text(encoding="utf-8")
    once = fill.filled(page, fill.values_for(page, tmp_path))
    assert "M1-concat, 200 steps: median 31.0 µs" in once
    assert "on one core of Some Processor." in once
    assert once.count("Not measured yet: `make bench-surrogate docs-control`.") == 1
    assert "make bench-stream docs-control" not in once
    assert fill.filled(once, fill.values_for(once, tmp_path)) == once


def test_documents_are_up_to_date_and_a_stale_one_is_told(tmp_path):
    copy = tmp_path / "REPRODUCING.md"
    shutil.copy(PATH.parents[1] / "REPRODUCING.md", copy)
    command = [sys.executable, PATH, copy, "--check"]
    assert subprocess.run(command, capture_output=True, text=True, check=False).returncode == 0
    stale = copy.read_text(encoding="utf-8").replace("<!-- machine -->", "<!-- machine -->not ")
    copy.write_text(stale, encoding="utf-8")
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert "is out of date" in ended.stderr


def test_the_page_for_reviewers_is_up_to_date_and_all_of_its_places_are_known():
    assert reproducibility.NAMES == fill.REPRODUCIBILITY
    page = PATH.parents[1] / "docs" / "reproducibility.md"
    done = subprocess.run([sys.executable, PATH, page, "--check"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", ["surrogate-models", "network"])
def test_the_pages_of_surrogates_are_up_to_date(name):
    page = PATH.parents[1] / "docs" / f"{name}.md"
    done = subprocess.run([sys.executable, PATH, page, "--check"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
