"""docs/dataset.md says what a file holds; this compares the two."""

import re
from pathlib import Path

import h5py
import pytest

from bem.cli.design_options import read_design_file
from bem.dataset.campaign import Campaign
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import run_here

ROOT = Path(__file__).parents[3]
TEXT = (ROOT / "docs" / "dataset.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("data") / "dataset.h5"
    run_here(Campaign(count=40, native=True), path, solver=stand_in.solve)
    return path


def test_the_documented_tree_is_the_files(path):
    documented = {
        name: (kind, shape.count(",") + 1 - shape.endswith(",)"))
        for name, kind, shape in re.findall(r"^\| `/([a-z_/]+)` \| (\w+) \| (\([^|]*\)) \|", TEXT, re.MULTILINE)
    }
    found = {}

    def visit(name, item):
        if isinstance(item, h5py.Dataset):
            found[name] = ("string" if h5py.check_string_dtype(item.dtype) else item.dtype.name, item.ndim)

    with h5py.File(path) as file:
        file.visititems(visit)
        table = TEXT[TEXT.index("| Attribute |") : TEXT.index("The group `/fms`")]
        cells = "".join(line.split("|")[1] for line in table.splitlines() if line.startswith("| `"))
        assert set(re.findall(r"`(\w+)`", cells)) == set(file.attrs)
        assert file["fms"].attrs["counts"].tolist() == [50, 20, 50]
    assert documented == found


def test_the_documented_python_runs(path):
    code = TEXT[TEXT.index("```python\n") + 10 :].split("```")[0]
    names = {}
    exec(code.replace("published/dataset.h5", str(path)), names)
    assert names["times"].shape == names["indentations"].shape == names["force"].shape == (40, 120)
    assert names["tabor"].shape == names["pull_off"].shape == (40,)


def test_the_documented_design_file_is_read(tmp_path):
    (tmp_path / "design.toml").write_text(TEXT[TEXT.index("```toml\n") + 8 :].split("```")[0], encoding="utf-8")
    assert read_design_file(tmp_path / "design.toml")["ranges"] == {"tabor": [1.0, 3.2]}
