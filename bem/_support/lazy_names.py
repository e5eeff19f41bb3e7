"""Public names of a package that load on first use, so that importing the package costs nothing."""

import ast
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any


def listed_names(source: str, package: str) -> dict[str, str]:
    """Return the names that the `__init__.py` of a package imports from its own modules, each with its module.

    These imports stand under `if TYPE_CHECKING`: a type checker reads them as they are, and here they are the one list
    of the public names.

    Args:
        source: The package's `__file__`.
        package: Its name.
    """
    home = {}
    for node in ast.walk(ast.parse(Path(source).read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            # `from package.module import name as name` is how a name is made public.
            public = {alias.name for alias in node.names if alias.asname == alias.name}
            home |= dict.fromkeys(public, node.module.removeprefix(f"{package}."))
    return home


def lazy_names(
    package: str, home: dict[str, str], namespace: dict[str, Any]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` of a package.

    Args:
        package: Its name.
        home: Public names, each with the module below the package that defines it.
        namespace: The package's `globals()`, in which a name stays once it was loaded.
    """

    def load(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        namespace[name] = value = getattr(import_module(f"{package}.{home[name]}"), name)
        return value

    return load, lambda: sorted({*namespace, *home})
