"""`python -m experiments NAME ...` runs the study of that name, whichever folder it stands in."""

import runpy
import sys
from pathlib import Path

HERE = Path(__file__).parent


def modules() -> dict[str, str]:
    """Every study's name and its module."""
    files = sorted(path for path in HERE.glob("*/*.py") if path.stem != "__init__")
    return {path.stem: f"experiments.{path.parent.name}.{path.stem}" for path in files}


def main() -> None:
    """Run one study with the words that follow its name."""
    known = modules()
    name = sys.argv[1] if len(sys.argv) > 1 else ""
    if name not in known:
        print(f"python -m experiments: Expected one of {', '.join(known)}; received {name!r}", file=sys.stderr)
        sys.exit(2)
    sys.argv[:2] = [f"experiments.{name}"]
    runpy.run_module(known[name], run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
