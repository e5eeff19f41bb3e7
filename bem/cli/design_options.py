"""What the command line and a design file say of a design; each refuses what it cannot read by a `ValueError`."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from bem._support.wording import shown


def parse_ratio(text: str) -> float | tuple[float, ...]:
    """Read `0.1` or `0.01:1`, as given on the command line."""
    try:
        numbers = tuple(map(float, text.split(":")))
    except ValueError:
        raise ValueError(f"modulus-ratio must read VALUE or LOW:HIGH; received {shown(text)}") from None
    return numbers[0] if len(numbers) == 1 else numbers


def parse_ranges(texts: Iterable[str]) -> dict[str, tuple[float, float]]:
    """Read several of `tabor=0.2:3.2`, as given on the command line; a single number fixes the quantity."""
    found: dict[str, tuple[float, float]] = {}
    for text in texts:
        name, _, bounds = map(str.strip, text.partition("="))
        low, colon, high = bounds.partition(":")
        if name in found:
            raise ValueError(f"range must name a quantity once; received {shown(name)} twice")
        try:
            found[name] = float(low), float(high if colon else low)
        except ValueError:
            raise ValueError(f"range must read NAME=LOW:HIGH or NAME=VALUE; received {shown(text)}") from None
    return found


def parse_shard(text: str | None) -> tuple[int, int]:
    """Read `3/8`; the only share of one where there is no text."""
    number, _, total = ("1/1" if text is None else text).partition("/")
    try:
        return int(number), int(total)
    except ValueError:
        raise ValueError(f"shard must read i/n, e.g. 3/8; received {shown(text)}") from None


def read_design_file(path: str | Path) -> dict[str, Any]:
    """Read a TOML file with any of `design`, `count`, `seed`, `accuracy`, `modulus_ratio` and a table `ranges`.

    Raises:
        FileNotFoundError: no such file.
        ValueError: not TOML, or a key it does not know.
    """
    # Imported here because it loads NumPy.
    from bem._support.text_files import read_toml

    path = Path(path)
    if path.is_dir():
        raise ValueError(f"design file must be a file; received the folder {str(path)!r}")
    if not path.is_file():
        raise FileNotFoundError(f"design file not found; received {str(path)!r}")
    try:
        content = read_toml(path)
    except ValueError as error:
        raise ValueError(f"design file must be TOML; received {str(path)!r} ({error})") from error
    known = ("design", "count", "seed", "accuracy", "modulus_ratio", "ranges")
    unknown = sorted(set(content) - set(known))
    if unknown:
        raise ValueError(f"design file may hold {', '.join(known)}; received {shown(unknown[0])} in {str(path)!r}")
    if not isinstance(content.get("ranges", {}), dict):
        raise ValueError(f"ranges must be a table of NAME = [LOW, HIGH]; received {shown(content['ranges'])}")
    return content
