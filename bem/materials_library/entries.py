"""The library's files: one TOML file for each published material, with its source, conditions, validity and caution.

A file holds `relaxed_modulus` (Pa) and `poisson_ratio`, and where relaxation was measured a table `prony` of
`relaxation_moduli` (Pa) and `relaxation_times` (s), and a table `wlf` of `reference` (degrees Celsius), `c1` and `c2`.
Files of your own are read by their path.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bem._support.text_files import read_toml
from bem._support.validation import finite_number, finite_vector, instance
from bem._support.wording import listed, shown
from bem.materials_library.viscoelasticity import shifted, wlf_shift
from bem.problem.materials import Elastic, PronySeries

FOLDER = Path(__file__).parent
TEXTS = ("title", "source", "conditions", "validity", "caution")
_OPTIONAL = ("doi", "licence", "method", "taken_from")
_NUMBERS = ("relaxed_modulus", "relaxed_modulus_interval", "poisson_ratio", "prony", "wlf")


@dataclass(frozen=True)
class Entry:
    """One published material; its times are in seconds, as a `Setup` without a retardation time takes them."""

    name: str
    title: str
    source: str
    conditions: str
    validity: str
    caution: str
    relaxed_modulus: float
    """Young's modulus after all relaxation that was measured, in Pa."""
    relaxed_modulus_interval: tuple[float, float] | None
    """As the source gives it, in Pa."""
    poisson_ratio: float
    material: Elastic | PronySeries
    wlf: tuple[float, float, float] | None
    """Reference temperature in degrees Celsius, c1, and c2 in kelvin."""
    notes: dict[str, str]
    """What else the file says: DOI, licence, method."""

    def at(self, temperature: float) -> Elastic | PronySeries:
        """The material at a temperature in degrees Celsius.

        Raises:
            ValueError: the entry has no WLF constants, or the temperature is out of their range.
        """
        if self.wlf is None:
            raise ValueError(
                f"the material {self.name} has no WLF constants; received a temperature of {temperature!r}"
            )
        reference, c1, c2 = self.wlf
        return shifted(self.material, wlf_shift(temperature, reference=reference, c1=c1, c2=c2))


def names() -> list[str]:
    """The names of the library's materials."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def load(name: str | Path) -> Entry:
    """Give a material of the library by its name, or one of your own by the path of its TOML file.

    Raises:
        ValueError: an unknown name, or a file that lacks its source or its numbers.
        FileNotFoundError: no file at the path.
    """
    path = Path(instance("material", name, (str, Path)))
    if path.suffix != ".toml":
        if str(name) not in names():
            raise ValueError(
                f"material must be one of {listed(names(), str(name))}, or a .toml file; received {shown(str(name))}"
            )
        path = FOLDER / f"{name}.toml"
    try:
        table = read_toml(path)
    except ValueError as error:
        raise ValueError(f"a material must be a TOML file; received {path} ({error})") from error
    for key in (*TEXTS, "relaxed_modulus", "poisson_ratio"):
        if key not in table:
            raise ValueError(f"{path} must have {key}; received {sorted(table)}")
    unknown = sorted(set(table) - {*TEXTS, *_OPTIONAL, *_NUMBERS})
    if unknown:
        raise ValueError(f"the keys of {path} must be those of the library; received {unknown}")
    for expected, cls, keys in (("text", str, (*TEXTS, *_OPTIONAL)), ("a table", dict, ("prony", "wlf"))):
        for key in keys:
            if not isinstance(table.get(key, cls()), cls):
                raise ValueError(f"{key} must be {expected} in {path}; received {shown(table[key])}")
    relaxed = finite_number("relaxed_modulus", table["relaxed_modulus"], above=0.0)
    interval = table.get("relaxed_modulus_interval")
    wlf = table.get("wlf")
    return Entry(
        name=path.stem,
        **{key: table[key] for key in TEXTS},
        relaxed_modulus=relaxed,
        relaxed_modulus_interval=None
        if interval is None
        else tuple(finite_vector("relaxed_modulus_interval", interval)),
        poisson_ratio=finite_number("poisson_ratio", table["poisson_ratio"], low=0.0, high=0.5),
        material=_material(table.get("prony"), relaxed, path),
        wlf=None if wlf is None else tuple(finite_number(key, wlf.get(key)) for key in ("reference", "c1", "c2")),
        notes={key: table[key] for key in _OPTIONAL if key in table},
    )


def _material(prony: dict | None, relaxed: float, path: Path) -> Elastic | PronySeries:
    if prony is None:
        return Elastic()
    if set(prony) != {"relaxation_moduli", "relaxation_times"}:
        raise ValueError(f"prony in {path} must have relaxation_moduli and relaxation_times; received {sorted(prony)}")
    moduli = finite_vector("relaxation_moduli", prony["relaxation_moduli"], at_least=1)
    return PronySeries.from_moduli(np.asarray(moduli) / relaxed, prony["relaxation_times"])
