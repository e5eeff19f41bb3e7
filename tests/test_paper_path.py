"""The whole path from no data to the report, on tiny data and one epoch, by the make target a reader would type."""

import shutil

import pytest

from tests.processes import ROOT, ended

FIGURES = {"1", "2", "3", "4", "5", "6", "7", "architectures", "features", "fms-transfer", "learning-curves", "mse-mae"}
TABLES = {"protocols-dataset", "dataset-summary", "protocols-canonical", "quartiles", "persson-brener", "models"}
TABLES |= {"features"}


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
def test_smoke(tmp_path):
    folder = tmp_path / "smoke"
    done = ended("make", "smoke", f"SMOKE={folder}", cwd=ROOT)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert "Stage paper" in done.stdout
    for suffix in ("pdf", "png"):
        drawn = {path.stem for path in (folder / "figures").glob(f"*.{suffix}")}
        assert drawn == {f"figure-{name}" for name in FIGURES} | {"graphical-abstract"}
    for suffix in ("md", "csv", "tex"):
        assert {path.stem for path in (folder / "tables").glob(f"*.{suffix}")} == TABLES
    report = (folder / "REPRODUCTION.md").read_text(encoding="utf-8")
    assert "Models not trained yet, 16 of 18" in report
    assert "M1-concat-large" in (folder / "tables" / "models.md").read_text(encoding="utf-8")
