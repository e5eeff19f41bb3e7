"""Which room of the code may import which: the arrows of the design, as data.

Every import counts, also one inside a function or for a type checker. A module belongs to the room with the longest
name that begins its own.
"""

import ast
from collections import Counter
from functools import cache
from graphlib import CycleError, TopologicalSorter

import pytest

from tests.processes import ROOT

PACKAGES = ("bem", "surrogate", "experiments", "paper_figures")
VOCABULARY = ("problem", "results")
MOST_MODULES = 16  # in a folder

WORDS = {"bem vocabulary", "bem._support"}
ELEMENTS = {"bem.methods", "bem.methods.closed_forms", *WORDS}  # boundary elements, and what all methods share
SOLVING = {"bem.simulation", "bem.methods.elastic_curve", "bem.methods.without_adhesion", *ELEMENTS}
BEM = {"bem", "bem.dataset", "bem.recommendation", *SOLVING}
SURROGATE = {
    "surrogate",
    "surrogate public names",
    "surrogate.training",
    "surrogate.onnx",
    "surrogate.onnx.intervals_graph",
    "surrogate.architectures",
    "surrogate.data",
    "surrogate.backend",
}
# Room by room, what it may import besides itself.
ALLOWED = {
    "bem._support": set(),
    "bem vocabulary": {"bem._support"},
    "bem.materials_library": WORDS,
    "bem.methods.closed_forms": WORDS,
    "bem.methods": WORDS | {"bem.methods.closed_forms"},
    "bem.methods.elastic_curve": ELEMENTS,
    "bem.methods.sharp_crack": ELEMENTS,
    "bem.methods.without_adhesion": ELEMENTS,
    "bem.simulation": SOLVING - {"bem.simulation"},
    "bem.recommendation": SOLVING,
    "bem.dataset": SOLVING,
    "bem.lab": SOLVING | {"bem.recommendation", "bem.materials_library"},
    "bem": SOLVING | {"bem.recommendation", "bem.dataset"},
    "bem.cli": BEM | {"bem.lab", "bem.materials_library"},
    # `surrogate` knows of `bem` the words, the data set file and the public calls.
    "surrogate.backend": set(),
    "surrogate.data": WORDS | {"bem.dataset"},
    "surrogate.architectures": {"bem._support", "surrogate.data", "surrogate.backend"},
    "surrogate.onnx": {"bem._support", "surrogate.data"},
    "surrogate.onnx.intervals_graph": WORDS | {"bem.dataset", "surrogate", "surrogate.onnx", "surrogate.data"},
    "surrogate.training": {"bem._support", "bem.dataset"}
    | SURROGATE - {"surrogate.training", "surrogate public names"},
    "surrogate": WORDS
    | {"bem.dataset", "surrogate.data", "surrogate.onnx", "surrogate.architectures", "surrogate.backend"},
    "surrogate public names": {"bem._support", "surrogate", "surrogate.architectures", "surrogate.training"},
    "surrogate.cli": WORDS | {"bem", "bem.dataset"} | SURROGATE,
    "experiments": BEM | {"bem.lab", "bem.materials_library"} | SURROGATE,
    # Figures read results; of the code they take names, file formats, and how a number is written.
    "paper_figures": WORDS | {"bem.dataset", "surrogate.architectures", "surrogate.onnx", "experiments"},
    # What runs a package takes the handler of Ctrl-C before.
    "bem.__main__": {"bem.cli", "bem._support"},
    "surrogate.__main__": {"surrogate.cli", "bem._support"},
}


def room_of(module):
    if module == "surrogate":
        return "surrogate public names"
    if module.partition(".")[0] == "bem" and module.split(".")[1:2] and module.split(".")[1] in VOCABULARY:
        return "bem vocabulary"
    return max((room for room in ALLOWED if module == room or module.startswith(f"{room}.")), key=len)


def is_module(name):
    path = ROOT / name.replace(".", "/")
    return path.with_suffix(".py").is_file() or (path / "__init__.py").is_file()


@cache
def imported(path):
    """Modules of this repository that a file imports, and the lines where."""
    every = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            assert not node.level, f"{path}: a relative import hides its room"
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            modules = [name if is_module(name) else node.module for name in names]
        elif isinstance(node, ast.Import):
            modules = [alias.name for alias in node.names]
        else:
            continue
        every += [(module, node.lineno) for module in modules if module.partition(".")[0] in PACKAGES]
    return every


def modules():
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            yield path, ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


@pytest.mark.parametrize("package", PACKAGES)
def test_arrows_run_one_way(package):
    wrong = []
    for path, module in modules():
        room = room_of(module)
        targets = imported(path) if module.partition(".")[0] == package else ()
        wrong += [
            f"{path.relative_to(ROOT)}:{line} {room} -> {room_of(target)}"
            for target, line in targets
            if room_of(target) not in {room, *ALLOWED[room]}
        ]
    assert wrong == []


def test_rooms_import_without_cycles():
    assert list(TopologicalSorter(ALLOWED).static_order())


def test_modules_import_without_cycles():
    """Lazy imports, and those for a type checker, are no way around a circle."""
    graph = {module: {target for target, _ in imported(path)} - {module} for path, module in modules()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_no_folder_outgrows_the_eye():
    folders = Counter(path.parent.relative_to(ROOT) for path, _ in modules() if path.name != "__init__.py")
    assert {str(folder): count for folder, count in folders.items() if count > MOST_MODULES} == {}
