"""Put the published M1-concat, `fast` and `accurate` into the wheel; everything else is said in `pyproject.toml`.

The weights have one home, `published`, so the build copies them rather than the repository holding them twice.
"""

import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

MODEL = "M1-concat"
FILES = ("model.onnx", "model.weights.h5", "run.json", "scaling.json", "metrics.json", "../split.json")


class BuildWithModel(build_py):
    """Copy the model directory's files into the package `surrogate`, where there is one."""

    def run(self) -> None:
        """Build, then copy."""
        super().run()
        source = Path(__file__).resolve().parent / "published" / "models" / MODEL
        if self.editable_mode or not source.is_dir():
            return
        target = Path(self.build_lib) / "surrogate" / "models" / MODEL
        target.mkdir(parents=True, exist_ok=True)
        for name in FILES:
            shutil.copyfile(source / name, target / Path(name).name)
        # Apart from the paper's, which are listed by their folders.
        if (pretrained := source.parents[1] / "pretrained").is_dir():
            shutil.copytree(pretrained, target.parent, dirs_exist_ok=True)


class SourceWithModel(sdist):
    """Add what `BuildWithModel` copies to a source distribution."""

    def make_distribution(self) -> None:
        """Add the published models to the usual files, and pack them."""
        self.filelist.graft(f"published/models/{MODEL}")
        self.filelist.include("published/models/split.json")
        self.filelist.graft("published/pretrained")
        super().make_distribution()


setup(cmdclass={"build_py": BuildWithModel, "sdist": SourceWithModel})
