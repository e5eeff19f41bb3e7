"""docs/dataset.md and docs/cluster.md say what a file holds; this compares."""

import re

import h5py
import pytest

from bem import Cases
from bem.cli.arguments import read_design_file
from bem.dataset.campaign import Campaign
from bem.dataset.sealed_file import arrays
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import run_here
from tests.processes import ROOT

TEXT, CASES = ((ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8") for name in ("dataset", "cluster"))
PLAN = Campaign(count=40, native=True)


@pytest.mark.parametrize(
    ("text", "job", "attributes"),
    [
        (TEXT, PLAN, r"(?s)\| Attribute \|.*?The group `/fms`"),
        (CASES, Cases(PLAN.cases_of(PLAN.indices)), r"(?s)Attributes of the root.*?\n\n"),
    ],
)
def test_the_documented_tree_is_the_files(text, job, attributes, tmp_path):
    words = re.search(attributes, text)[0]
    if words.startswith("| Attribute"):
        words = "".join(line.split("|")[1] for line in words.splitlines() if line.startswith("| `"))
    with h5py.File(run_here(job, tmp_path / "file.h5", solver=stand_in.solve).path) as file:
        sizes = {"n": 40, "n + 1": 41, "N": 120, "m": int(file["native/offsets"][-1])}
        sizes["j"] = len(file["jumps/trajectory"]) if "jumps" in file else 0
        found = {
            (name, "string" if h5py.check_string_dtype(item.dtype) else item.dtype.name, item.shape)
            for name, item in arrays(file)
        }
        assert set(re.findall(r"`([a-z_]+)`", words)) == set(file.attrs)
        assert "fms" not in file or file["fms"].attrs["counts"].tolist() == [50, 20, 50]
    rows = re.findall(r"^\| `/([a-z_/]+)` \| (\w+) \| \(([^|]*?),?\) \|", text, re.MULTILINE)
    assert {(name, kind, tuple(sizes[one] for one in shape.split(", "))) for name, kind, shape in rows} == found


def test_the_documented_python_runs(tmp_path):
    path = run_here(PLAN, tmp_path / "dataset.h5", solver=stand_in.solve).path
    code = TEXT[TEXT.index("```python\n") + 10 :].split("```")[0]
    names = {}
    exec(code.replace("published/dataset.h5", str(path)), names)
    assert names["times"].shape == names["indentations"].shape == names["force"].shape == (40, 120)
    assert names["tabor"].shape == names["pull_off"].shape == (40,)


def test_the_documented_design_file_is_read(tmp_path):
    (tmp_path / "design.toml").write_text(TEXT[TEXT.index("```toml\n") + 8 :].split("```")[0], encoding="utf-8")
    assert read_design_file(tmp_path / "design.toml")["ranges"] == {"tabor": [1.0, 3.2]}
