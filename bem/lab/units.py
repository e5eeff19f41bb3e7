"""Quantities with units: from text such as "50 um" or "50mJ/m2", or from a Pint quantity, to plain SI numbers.

A plain number is SI already, and needs no library. Text with a unit needs Pint, the optional extra `lab`. Exponents may
be written as in laboratory notes: "mJ/m2" is mJ/m^2.
"""

from __future__ import annotations

import functools
import math
import re
from numbers import Real
from typing import Any, Protocol

from bem._support.wording import shown


class WithUnit(Protocol):
    """A quantity of Pint, of any registry."""

    @property
    def units(self) -> Any:
        """Its unit."""

    def to(self, unit: Any, /) -> Any:
        """The same in another unit."""


Quantity = float | str | WithUnit
"""What a user may give: a plain number in SI, text of a number and a unit, or a quantity of Pint."""

INSTALL = "pip install 'contact-trajectories[lab]'"

DIMENSIONS = {
    "length": "m",
    "force": "N",
    "pressure": "Pa",
    "energy per area": "J/m^2",
    "time": "s",
    "speed": "m/s",
    "stiffness": "N/m",
    "temperature": "K",
    "number": "",
}
"""The SI unit of each kind of quantity."""


def to_si(name: str, value: Any, dimension: str) -> float:
    """Give a quantity as a plain number in SI.

    Args:
        name: The quantity, for messages.
        value: A real number, which is SI already; text of a number and a unit; or a Pint quantity.
        dimension: One of `DIMENSIONS`.

    Returns:
        The number, in the SI unit of the dimension.

    Raises:
        ValueError: a unit that is unknown or does not fit, text that is no quantity, or a unit without Pint installed.
    """
    if isinstance(value, Real) and not isinstance(value, bool):
        return float(value)
    unit = DIMENSIONS[dimension]
    wanted = f"{name} must be {_a(dimension)}, such as {_example(unit)}"
    if isinstance(value, str):
        try:
            return float(value)
        except ValueError:
            number, written = _split(value, wanted)
        # To 15 digits, so that 5 um is 5e-06 and not a neighbour of it.
        return float(f"{number * factor(name, written, dimension):.15g}")
    if hasattr(value, "to") and hasattr(value, "units"):
        try:
            return float(value.to(unit or "dimensionless").magnitude)
        except Exception as error:  # Pint's own errors, of whichever registry the quantity belongs to
            raise ValueError(f"{wanted}; received {shown(str(value))}") from error
    raise ValueError(f"{wanted}; received {shown(value)}")


def factor(name: str, unit: str, dimension: str) -> float:
    """Give the number of SI units in one `unit` of a kind of quantity.

    Raises:
        ValueError: the unit is unknown or does not fit, or Pint is not installed and the unit is not the SI one.
    """
    si = DIMENSIONS[dimension]
    if _spelled_out(unit) == si:
        return 1.0
    registry = _registry()
    if registry is None:
        raise ValueError(
            f"{name} must be a plain number in {si or 'no unit'} unless Pint is installed ({INSTALL}); "
            f"received the unit {shown(unit)}"
        )
    try:
        found = float(registry.Quantity(1.0, _spelled_out(unit)).to(si or "dimensionless").magnitude)
    except Exception as error:  # an unknown unit, a unit of another dimension, or text that is no unit
        raise ValueError(
            f"{name} must be {_a(dimension)}, in a unit such as {si}; received the unit {shown(unit)}"
        ) from error
    if not math.isfinite(found):
        raise ValueError(f"{name} must be {_a(dimension)}, in a unit such as {si}; received the unit {shown(unit)}")
    return found


def readable(value: float, unit: str) -> str:
    """Write an SI number with an engineering prefix and four digits: 5.03e-05, "m" gives "50.3 um"."""
    if not math.isfinite(value) or value == 0.0 or unit in ("", "J/m^2"):
        scaled, prefix = (value * 1e3, "m") if unit == "J/m^2" and math.isfinite(value) else (value, "")
        return f"{scaled:.4g} {prefix}{unit}".strip()
    exponent = min(max(3 * math.floor(math.log10(abs(value)) / 3), -15), 12)
    return f"{value / 10.0**exponent:.4g} {_PREFIXES[exponent]}{unit}"


_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S.*)")


def _split(text: str, wanted: str) -> tuple[float, str]:
    match = _NUMBER.fullmatch(text)
    if match is None:
        raise ValueError(f"{wanted}; received {shown(text)}")
    return float(match[1]), match[2].strip()


def _spelled_out(unit: str) -> str:
    """A unit with its exponents marked, `m2` as `m^2`, and the two micro signs as `u`."""
    plain = unit.strip().replace("µ", "u").replace("μ", "u").replace("²", "^2").replace("³", "^3")
    return re.sub(r"(?<=[A-Za-z])(-?\d+)", r"^\1", plain)


def _a(dimension: str) -> str:
    return f"an {dimension}" if dimension[0] in "aeiou" else f"a {dimension}"


def _example(unit: str) -> str:
    return {
        "m": "'50 um'",
        "N": "'5 mN'",
        "Pa": "'2 MPa'",
        "J/m^2": "'50 mJ/m2'",
        "s": "'10 ms'",
        "m/s": "'1 um/s'",
    }.get(unit, f"'1 {unit}'" if unit else "0.1")


@functools.cache
def _registry() -> Any:
    """Pint's registry, or `None` where Pint is not installed."""
    try:
        import pint
    except ImportError:
        return None
    return pint.UnitRegistry(cache_folder=None)
