"""Whatever a file holds, a reader returns what it says or raises one sentence, soon, and prints nothing."""

import json
import random
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest

from bem import materials_library
from bem.cli.arguments import read_design_file
from bem.lab import ForceCurve
from experiments.common import read_config
from surrogate.cli.predict_io import read_table
from surrogate.data.dataset import Split
from surrogate.data.scaling import Scaling
from surrogate.training.recipe import Recipe
from tests.data_files import damaged
from tests.processes import ROOT

CURVE = "time (s),indentation (um),force (mN)\n" + "".join(f"{i},{i * 0.5:g},{-i * i:g}\n" for i in range(30))
DESIGN = 'design = "independent"\ncount = 12\nseed = 3\naccuracy = 1e-3\n[ranges]\ntabor = [1.0, 5.0]\n'
PROTOCOLS = [{"peak_indentation": 20.0, "loading_rate": 10.0, "dwell_time": 1.0, "unloading_rate": 10.0, "tabor": 1.0}]
TABLE = "".join(",".join(map(str, row)) + "\n" for row in (PROTOCOLS[0], *[PROTOCOLS[0].values()] * 5))
MODEL = ROOT / "published" / "models" / "M1-concat"
READERS = {
    "curve.csv": (CURVE, ForceCurve.read),
    "protocols.csv": (TABLE, read_table),
    "protocols.json": (json.dumps(PROTOCOLS * 5), read_table),
    "design.toml": (DESIGN, read_design_file),
    "material.toml": (next(materials_library.entries.FOLDER.glob("*.toml")).read_text(), materials_library.load),
    "recipe.toml": ((ROOT / "surrogate/training/recipes/swift.toml").read_text(), Recipe.load),
    "scaling.json": ((MODEL / "scaling.json").read_text(), Scaling.load),
    "split.json": (json.dumps({"seed": 1, "train": [0, 1], "validation": [2], "test": [3]}), Split.load),
    "persson_brener.toml": ("model = 'M1-concat'\nfit_within = 0.02\n", read_config),
}
AFM = ("curve.h5", "curve.ibw", "curve.zip", "curve.jpk-force", "curve.tab")
HOSTILE = {
    "toml": (
        *("x = " + "[" * 10**5 + "]" * 10**5, "x = " + "{a = " * 5000 + "1" + "}" * 5000, "a." * 50_000 + "b = 1"),
        *('"a,".' * 50_000 + "b = 1", "0." * 50_000 + "0 = 1", "x = {" + "b." * 50_000 + "c = 1}", "x = 1\n" * 200_000),
    ),
    "json": ("[" * 10**6, '{"a":' * 10**5, '["]",' * 10**4, '{"x": ' + "9" * 10**5 + "}"),
    "csv": (
        *("x" * 200_000 + "\n1\n2\n3\n", '"' + "1\n" * 200_000, "a" + " " * 10**5 + "!,b\n1,2\n2,3\n", "," * 10**6),
        "time (s),indentation (10**10**10*m),force (N)\n0,0,0\n1,1,1\n",
    ),
}


def refusal(read, path):
    """The sentence of a reader that refuses a file, or `None`."""
    try:
        read(path)
        sentence = None
    except ValueError as error:
        sentence = str(error)
        assert "\n" not in sentence
        assert len(sentence) < 1000
    return sentence


@pytest.fixture(autouse=True)
def silent(capfd):
    yield
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", READERS)
def test_hostile_files_are_refused(name, tmp_path):
    text, read = READERS[name]
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    assert refusal(read, path) is None
    for hostile in (*HOSTILE[name.rpartition(".")[2]], "\0" * 10, "", "nothing"):
        path.write_text(hostile, encoding="utf-8")
        assert refusal(read, path) or not hostile


def test_large_file_is_refused_unparsed(tmp_path):
    (tmp_path / "large").write_bytes(b" " * (2**26 + 1))
    for name, (_, read) in READERS.items():
        (tmp_path / name).hardlink_to(tmp_path / "large")
        assert refusal(read, tmp_path / name), name


@pytest.mark.parametrize("name", AFM)
def test_file_not_of_afm_gives_one_sentence(name, tmp_path):
    pytest.importorskip("afmformats")
    (tmp_path / name).write_bytes(random.Random(name).randbytes(3000))
    assert "AFM file" in refusal(ForceCurve.read, tmp_path / name)


@pytest.mark.slow
@pytest.mark.parametrize("name", [*READERS, *AFM])
def test_damaged_files_are_read_or_refused(name, tmp_path):
    path, rng, read = tmp_path / name, random.Random(name), ForceCurve.read
    if name in READERS:
        original, read = READERS[name][0].encode(), READERS[name][1]
    else:
        original = afm_file(tmp_path, Path(name).suffix)
    for _ in range(200):
        path.write_bytes(damaged(original, rng))
        refusal(read, path)


def afm_file(folder, suffix):
    """A file like those of a format: a whole one, or one that its reader takes for its own at first sight."""
    formats = pytest.importorskip("afmformats")
    if suffix in (".ibw", ".tab"):
        return b"\5\0" + bytes(3000) if suffix == ".ibw" else CURVE.replace(",", "\t").encode()
    path = folder / f"whole{suffix}"
    if suffix != ".h5":
        with ZipFile(path, "w") as archive:
            archive.writestr("header.properties", CURVE)
            archive.writestr("segments/0/segment-header.properties", CURVE)
        return path.read_bytes()
    ramp = np.concatenate([np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.0, 50)])
    data = {"time": np.arange(100.0), "force": 1e-9 * ramp, "height (measured)": -1e-6 * ramp}
    data["segment"] = np.repeat(np.array([0, 1], dtype=np.uint8), 50)
    facts = {"spring constant": 40.0, "imaging mode": "force-distance", "path": folder / "x", "enum": 0}
    formats.AFMForceDistance(data, facts).export_data(path, fmt="hdf5")
    return path.read_bytes()
