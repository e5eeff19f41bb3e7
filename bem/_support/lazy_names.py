"""Public names of a package that load on first use, so that importing the package costs nothing."""

from collections.abc import Callable
from importlib import import_module
from typing import Any


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
