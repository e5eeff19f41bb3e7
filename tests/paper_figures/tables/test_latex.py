"""The tables compile, and none is wider than the text."""

import shutil
import subprocess
from importlib import import_module

import pytest

from paper_figures.__main__ import modules, save
from tests.paper_figures.inputs import read_inputs

PACKAGES = r"\usepackage[textwidth=180mm]{geometry}\usepackage{booktabs,tabularx}"
HEAD = rf"\documentclass[a4paper]{{article}}{PACKAGES}\begin{{document}}"


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="LaTeX is not installed")
def test_tables_compile_within_text_width(tmp_path, monkeypatch):
    monkeypatch.setattr("paper_figures.style.drawing.save", lambda *_: None)
    for name, module in modules().items():
        try:
            composed = import_module(module).compose
            results = read_inputs(name)
        except FileNotFoundError:
            continue
        if name != "figure-architectures" and ("tables" in module or "dict" in str(composed.__annotations__["return"])):
            save(composed(*results), tmp_path / f"{name.removeprefix('table-')}.md")
    names = sorted(path.stem for path in tmp_path.glob("*.tex"))
    assert len(names) > 10
    body = "\n".join(rf"\input{{{name}}}\clearpage" for name in names)
    (tmp_path / "all.tex").write_text(f"{HEAD}\n{body}\n\\end{{document}}\n", encoding="utf-8")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "all.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, errors="replace", check=False)
    assert done.returncode == 0, done.stdout[-2000:]
    wide = [line for line in done.stdout.splitlines() if line.startswith(r"Overfull \hbox")]
    assert wide == []
