"""Fill the numbers that README.md quotes from the files they come from, so that none is typed by hand.

A place reads `<!-- NAME -->number<!-- end -->`, which shows as the number alone. Numbers: those of the published data
set, and the paper's own from `experiments/paper_values/`.

Usage: `python tools/readme_numbers.py` writes them; `--check` only tells whether they are up to date.
"""

import argparse
import re
import sys
import tomllib
from pathlib import Path

from bem.dataset.file import load_dataset

ROOT = Path(__file__).resolve().parent.parent
PLACE = re.compile(r"<!-- ([a-z0-9-]+) -->(.*?)<!-- end -->")


def numbers(root: Path) -> dict[str, str]:
    """The numbers by name, as they are to be read."""
    dataset = load_dataset(root / "published/dataset.h5")
    attributes, seconds = dataset.attributes, dataset.scalars["solver_seconds"]
    paper = tomllib.loads((root / "experiments/paper_values/dataset.toml").read_text(encoding="utf-8"))
    return {
        "trajectories": f"{int(attributes['count']):,}",
        "core-minutes": f"{seconds.sum() / 60.0:.2g}",
        "milliseconds": f"{1e3 * seconds.mean():.0f}",
        "paper-cpu-hours": str(paper["cpu_hours"]),
    }


def filled(text: str, values: dict[str, str]) -> str:
    """The text with every place filled.

    Raises:
        ValueError: a place asks for a number that is not known.
    """

    def fill(match: re.Match) -> str:
        name = match[1]
        if name not in values:
            raise ValueError(f"places must be named one of {', '.join(values)}; received {name!r}")
        return f"<!-- {name} -->{values[name]}<!-- end -->"

    return PLACE.sub(fill, text)


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Fill the numbers of README.md.")
    parser.add_argument("--check", action="store_true", help="change nothing; fail when a number is out of date")
    parser.add_argument("--root", type=Path, default=ROOT)
    given = parser.parse_args()
    readme = given.root / "README.md"
    text = readme.read_text(encoding="utf-8")
    try:
        wanted = filled(text, numbers(given.root))
    except (ValueError, OSError) as error:
        print(f"readme_numbers: {error}", file=sys.stderr)
        return 2
    if wanted == text:
        return 0
    if given.check:
        print("readme_numbers: README.md is out of date; run `python tools/readme_numbers.py`", file=sys.stderr)
        return 1
    readme.write_text(wanted, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
