"""Which room of the code may import which: the arrows of the design, as data.

Every import counts, also one inside a function. A module belongs to the room with the longest name that begins its own.
"""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("bem", "surrogate", "experiments", "paper_figures")

VOCABULARY = ("scene", "materials", "tractions", "protocol", "accuracy", "trajectory")
ROOMS = {f"bem.{name}": "bem vocabulary" for name in VOCABULARY}
# Names that moved stand here until they go.
ROOMS |= {f"{name}": "forwarding" for name in ("bem.dataset_file", "surrogate.histories", "surrogate.layers")}

BASE = {"bem._support"}
WORDS = BASE | {"bem vocabulary"}
SOLVING = WORDS | {"bem.reference_solutions", "bem.solver"}
# Room by room, what it may import besides itself. No room is imported by one that it imports.
ALLOWED = {
    "bem._support": set(),
    "bem vocabulary": BASE,
    "bem.reference_solutions": WORDS,
    "bem.plots": WORDS,
    "bem.solver": WORDS | {"bem.reference_solutions"},
    "bem.effects": SOLVING,
    "bem.dataset": SOLVING,
    "bem.lab": SOLVING | {"bem.effects", "bem.plots"},
    "bem": SOLVING | {"bem.effects", "bem.dataset"},
    "bem.cli": SOLVING | {"bem", "bem.effects", "bem.dataset", "bem.lab", "bem.plots"},
    "surrogate.backend": set(),
    "surrogate.data": WORDS | {"bem.dataset"},
    "surrogate.architectures": BASE | {"surrogate.backend", "surrogate.data"},
    "surrogate.network": BASE | {"surrogate.data"},
}
