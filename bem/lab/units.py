"""Quantities with units: from text such as "50 um" or "50mJ/m2", or from a Pint quantity, to plain SI numbers.

A plain number is SI already. A unit in text is a product of names and prefixes of the tables below, with exponents as
in laboratory notes: "mJ/m2" is mJ/m^2. Text is looked up, never evaluated.
"""

from __future__ import annotations

import math
import re
from contextlib import suppress
from numbers import Real
from typing import Any, Literal, Protocol, get_args

from bem._support.wording import shown


class WithUnit(Protocol):
    """A quantity of Pint, of any registry."""

    def to(self, unit: Any, /) -> Any:
        """The same in another unit."""


Quantity = float | str | WithUnit
"""What a user may give: a plain number in SI, text of a number and a unit, or a quantity of Pint."""

ForceSign = Literal["tension", "compression"]

DIMENSIONS = {
    "length": ("m", "a length, such as '50 um'"),
    "force": ("N", "a force, such as '5 mN'"),
    "pressure": ("Pa", "a pressure, such as '2 MPa'"),
    "energy per area": ("J/m^2", "an energy per area, such as '50 mJ/m2'"),
    "time": ("s", "a time, such as '10 ms'"),
    "speed": ("m/s", "a speed, such as '1 um/s'"),
    "stiffness": ("N/m", "a stiffness, such as '1 N/m'"),
    "sensitivity": ("m/V", "a sensitivity, such as '50 nm/V'"),
    "number": ("", "a number, such as 0.1"),
}
"""The SI unit of each kind of quantity, and its name with an example."""

_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}
_LONG = {-15: "femto", -12: "pico", -9: "nano", -6: "micro", -3: "milli", -2: "centi", 3: "kilo", 6: "mega", 9: "giga"}
_POWERS = {"c": -2, **{prefix: power for names in (_PREFIXES, _LONG) for power, prefix in names.items()}}
_TABLE = (
    ("m meter meters metre metres", 1.0, (0, 1, 0)),
    ("micron microns", 1e-6, (0, 1, 0)),
    ("angstrom Å", 1e-10, (0, 1, 0)),
    ("s sec second seconds", 1.0, (0, 0, 1)),
    ("min", 60.0, (0, 0, 1)),
    ("h", 3600.0, (0, 0, 1)),
    ("Hz", 1.0, (0, 0, -1)),
    ("g gram grams", 1e-3, (1, 0, 0)),
    ("N newton newtons", 1.0, (1, 1, -2)),
    ("dyn", 1e-5, (1, 1, -2)),
    ("Pa pascal pascals", 1.0, (1, -1, -2)),
    ("bar", 1e5, (1, -1, -2)),
    ("J joule joules", 1.0, (1, 2, -2)),
    ("erg", 1e-7, (1, 2, -2)),
    ("V volt volts", 1.0, (1, 2, -3)),  # the ampere counts as a number, which no other unit here has
    ("1", 1.0, (0, 0, 0)),
    ("%", 0.01, (0, 0, 0)),
)
"""Names of units, their size in SI, and their exponents of kg, m and s."""
_UNITS = {name: (size, exponents) for names, size, exponents in _TABLE for name in names.split()}


def require_sign(force_sign: str) -> None:
    """Raise a `ValueError` unless the sign is 'tension' or 'compression'."""
    if force_sign not in get_args(ForceSign):
        raise ValueError(f"force_sign must be 'tension' or 'compression'; received {shown(force_sign)}")


def to_si(name: str, value: Any, dimension: str) -> float:
    """Give a quantity as a plain number in SI.

    Args:
        name: The quantity, for messages.
        value: A real number, which is SI already; text of a number and a unit; or a Pint quantity.
        dimension: One of `DIMENSIONS`.

    Returns:
        The number, in the SI unit of the dimension.

    Raises:
        ValueError: a unit that is unknown or does not fit, or text that is no quantity.
    """
    if isinstance(value, Real) and not isinstance(value, bool):
        return float(value)
    unit, example = DIMENSIONS[dimension]
    if isinstance(value, str):
        with suppress(ValueError):
            return float(value)
        if match := _QUANTITY.fullmatch(value) if len(value) <= _LONGEST else None:
            # To 15 digits, so that 5 um is 5e-06 and not a neighbour of it.
            return float(f"{float(match[1]) * factor(name, match[2].strip(), dimension):.15g}")
    elif hasattr(value, "to"):
        with suppress(Exception):  # Pint's own errors, of whichever registry the quantity belongs to
            return float(value.to(unit or "dimensionless").magnitude)
        value = str(value)
    raise ValueError(f"{name} must be {example}; received {shown(value)}")


def factor(name: str, unit: str, dimension: str) -> float:
    """Give the number of SI units in one `unit` of a kind of quantity.

    Raises:
        ValueError: the unit is unknown or does not fit.
    """
    si, example = DIMENSIONS[dimension]
    size, exponents = _measured(unit)
    if exponents != _measured(si)[1] or not 0.0 < size < math.inf:
        quantity = example.partition(",")[0]
        raise ValueError(f"{name} must be {quantity}, in a unit such as {si}; received the unit {shown(unit)}")
    return size


def readable(value: float, unit: str) -> str:
    """Write an SI number with an engineering prefix and four digits: 5.03e-05, "m" gives "50.3 um"."""
    if not math.isfinite(value) or value == 0.0 or unit in ("", "J/m^2"):
        scaled, prefix = (value * 1e3, "m") if unit == "J/m^2" and math.isfinite(value) else (value, "")
        return f"{scaled:.4g} {prefix}{unit}".strip()
    exponent = min(max(3 * math.floor(math.log10(abs(value)) / 3), -15), 12)
    return f"{value / 10.0**exponent:.4g} {_PREFIXES[exponent]}{unit}"


_LONGEST = 100  # characters of a quantity
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S.*)")
_FACTOR = re.compile(r"([A-Za-zÅ%]+|1)(?:\^?([-+]?\d))?")
_PLAIN = str.maketrans({"µ": "u", "μ": "u", "\u212b": "Å", "²": "2", "³": "3", "⁻": "-", "·": "*"})


def _measured(unit: str) -> tuple[float, list[int] | None]:
    """Size of a unit in SI, and its exponents of kg, m and s; without exponents, it is no unit."""
    if len(unit) > _LONGEST:
        return math.nan, None
    # Every second part is an operator; a space multiplies.
    parts = re.split(r"\s*([/*\s])\s*", unit.strip().translate(_PLAIN).replace("**", "^") or "1")
    size, total = 1.0, [0, 0, 0]
    for operator, part in zip(["*", *parts[1::2]], parts[::2], strict=True):
        match = _FACTOR.fullmatch(part)
        name = max((candidate for candidate in _UNITS if match and match[1].endswith(candidate)), key=len, default="")
        if match is None or not name or match[1].removesuffix(name) not in _POWERS:
            return math.nan, None
        exponent = int(match[2] or 1) * (-1 if operator == "/" else 1)
        size *= (_UNITS[name][0] * 10.0 ** _POWERS[match[1].removesuffix(name)]) ** exponent
        total = [sum_ + exponent * candidate for sum_, candidate in zip(total, _UNITS[name][1], strict=True)]
    return size, total
