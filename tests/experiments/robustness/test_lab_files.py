"""The tables of instruments' files say what was read, fitted and refused, and what nanite says."""

import numpy as np
import pytest

from experiments.robustness import lab_files
from experiments.robustness.lab_curves import CLASSES, write_map


def test_every_file_is_read_fitted_or_refused_with_its_reason(tmp_path, monkeypatch):
    pytest.importorskip("afmformats")
    data = tmp_path / "formats-1.0/tests/data"
    data.mkdir(parents=True)
    (data / "fmt-b.ibw").write_bytes(b"nothing")
    write_map(data / "fmt-a.h5", [CLASSES["hertz"](np.random.default_rng(seed), noise=0.01)[0] for seed in range(3)])
    said = [{"modulus": 2e3, "rating": 7.0, "seconds": 0.3}, {"reason": "no", "seconds": 0.1}]
    monkeypatch.setattr(lab_files, "beside", lambda *_: said)
    found = lab_files.study(folder=tmp_path)
    rows = lab_files.files_text(found).splitlines()[2:]
    assert [row.split("|")[1:6] for row in rows] == [
        [" `.h5` ", " 1 ", " 2 ", " 2 ", " 2 "],
        [" `.ibw` ", " 1 ", " 0 ", " 0 ", " 0 "],
    ]
    assert "| fmt-a.h5, 0 |" in lab_files.beside_text(found)
    assert "hertz, adequate | 7.0 |" in lab_files.beside_text(found)
    assert "fmt-a.h5, 1" not in lab_files.beside_text(found)


def test_without_nanite_nothing_is_beside(tmp_path):
    assert lab_files.beside(None, tmp_path) == []
    assert lab_files.beside("false", tmp_path) == []
