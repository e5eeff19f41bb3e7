"""Public names of a package that load on first use, so that importing the package costs nothing."""

import ast
from importlib import import_module
from pathlib import Path
from typing import Any


def lazy_names(namespace: dict[str, Any]) -> list[str]:
    """Return the public names of a package with these `globals()`, and let each load on first use and stay there.

    They are those that its `__init__.py` imports from its own modules, as `from package.module import name as name`.
    These imports stand under `if TYPE_CHECKING`: a type checker reads them as they are, and here they are the one list
    of the public names.
    """
    package: str = namespace["__name__"]
    home: dict[str, str] = {}
    for node in ast.walk(ast.parse(Path(namespace["__file__"]).read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            home |= {alias.name: node.module for alias in node.names if alias.asname == alias.name}

    def load(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        namespace[name] = value = getattr(import_module(home[name]), name)
        return value

    namespace.update(__getattr__=load, __dir__=lambda: sorted({*namespace, *home}))
    return sorted(home)
