"""Which room of the code may import which: the arrows of the design, as data.

Every import counts, also one inside a function. A module belongs to the room with the longest name that begins its own.
"""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("bem", "surrogate", "experiments", "paper_figures")
VOCABULARY = ("scene", "materials", "tractions", "protocol", "accuracy", "trajectory", "plots")

SUPPORT = {"bem._support", "bem._numerics"}
WORDS = {"bem vocabulary", *SUPPORT}
SOLVING = {"bem.reference_solutions", "bem.solver", *WORDS}
BEM = {"bem", "bem.dataset", "bem.effects", *SOLVING}
PREDICTING = {
    "surrogate.inference",
    "surrogate.network",
    "surrogate.architectures",
    "surrogate.data",
    "surrogate.backend",
}
SURROGATE = {"surrogate", "surrogate.training", "surrogate.export", "surrogate.pretrained", *PREDICTING}
# Room by room, what it may import besides itself.
ALLOWED = {
    "bem._support": set(),
    "bem._numerics": {"bem._support"},
    "bem vocabulary": SUPPORT,
    "bem.materials_library": WORDS,
    "bem.reference_solutions": WORDS,
    "bem.solver": WORDS | {"bem.reference_solutions"},
    "bem.effects": SOLVING,
    "bem.dataset": SOLVING,
    "bem.lab": SOLVING | {"bem", "bem.effects", "bem.materials_library"},
    "bem": SOLVING | {"bem.effects", "bem.dataset"},
    "bem.cli": BEM | {"bem.lab", "bem.materials_library"},
    # `surrogate` knows of `bem` the words, the data set file and the public calls.
    "surrogate.backend": set(),
    "surrogate.data": WORDS | {"bem.dataset"},
    "surrogate.architectures": SUPPORT | {"surrogate.data", "surrogate.backend"},
    "surrogate.network": SUPPORT | {"surrogate.data"},
    "surrogate.inference": WORDS | {"bem.dataset"} | PREDICTING,
    "surrogate.export": SUPPORT | {"bem.dataset"} | PREDICTING,
    "surrogate.pretrained": WORDS | {"bem.dataset", "surrogate.data", "surrogate.inference", "surrogate.network"},
    "surrogate.training": SUPPORT | {"bem.dataset", "surrogate.export", "surrogate.pretrained"} | PREDICTING,
    "surrogate": {"surrogate.inference", "surrogate.architectures", "surrogate.pretrained"},
    "surrogate.cli": WORDS | {"bem", "bem.dataset"} | SURROGATE,
    "experiments": BEM | {"bem.lab", "bem.materials_library"} | SURROGATE,
    # Figures read results; of the code they take names, and how a number is written.
    "paper_figures": {*SUPPORT, "bem.dataset", "surrogate.architectures", "experiments"},
}
# What moved: names that forward until they go, and what runs a package.
FORWARDING = {"bem.dataset_file": "bem.dataset", "surrogate.histories": "surrogate.inference"}
FORWARDING |= {"surrogate.layers": "surrogate.architectures"}
RUNNING = {"bem.__main__": "bem.cli", "surrogate.__main__": "surrogate.cli"}


def room_of(module):
    if module in FORWARDING or module in RUNNING:
        return module
    if module.partition(".")[0] == "bem" and module.split(".")[1:2] and module.split(".")[1] in VOCABULARY:
        return "bem vocabulary"
    rooms = [room for room in ALLOWED if module == room or module.startswith(f"{room}.")]
    return max(rooms, key=len)


def is_module(name):
    path = ROOT / name.replace(".", "/")
    return path.with_suffix(".py").is_file() or (path / "__init__.py").is_file()


def imported(path):
    """Modules of this repository that a file imports, and the lines where."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            assert not node.level, f"{path}: a relative import hides its room"
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            found = [name if is_module(name) else node.module for name in names]
        elif isinstance(node, ast.Import):
            found = [alias.name for alias in node.names]
        else:
            continue
        yield from ((module, node.lineno) for module in found if module.partition(".")[0] in PACKAGES)


def modules():
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            yield path, ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


@pytest.mark.parametrize("package", PACKAGES)
def test_arrows_run_one_way(package):
    wrong = []
    for path, module in modules():
        if module.partition(".")[0] != package:
            continue
        room = room_of(module)
        moved = FORWARDING.get(module) or RUNNING.get(module)
        allowed = {moved} if moved else ALLOWED[room]
        for target, line in imported(path):
            to = room_of(target)
            if to != room and to not in allowed:
                wrong.append(f"{path.relative_to(ROOT)}:{line} {room} -> {to}")
    assert wrong == []


def test_no_room_is_imported_by_one_that_it_imports():
    def above(room, seen):
        for other in ALLOWED[room] - {room} - seen:
            seen |= {other, *above(other, seen | {other})}
        return seen

    circles = [room for room in set(ALLOWED) - PREDICTING for other in ALLOWED[room] if room in above(other, set())]
    assert circles == []


def test_no_folder_outgrows_the_eye():
    crowded = {}
    for path, _ in modules():
        if path.name != "__init__.py":
            folder = str(path.parent.relative_to(ROOT))
            crowded[folder] = crowded.get(folder, 0) + 1
    assert {folder: count for folder, count in crowded.items() if count > 14} == {}
