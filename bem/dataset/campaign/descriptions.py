"""Scenes and protocols as JSON: `{"type": "Scene", "tabor": 1.0, "material": {"type": "Elastic"}, ...}`.

Objects are described by the name of their public class and its fields. Numbers are written with all their digits.
"""

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from bem import materials, protocol, scene, tractions
from bem._support.wording import shown

_VOCABULARY = (materials, protocol, scene, tractions)


def described(value: Any) -> Any:
    """Describe an object of one of the public classes by what JSON can hold.

    Raises:
        ValueError: an object of another class, which could not be read again.
    """
    if is_dataclass(value):
        name = type(value).__name__
        _public(name, type(value))
        values = {field.name: getattr(value, field.name) for field in fields(value)}
        if values.get("spring", 0.0) is None:  # as before there were springs
            del values["spring"]
        return {"type": name} | {field: described(kept) for field, kept in values.items()}
    if isinstance(value, np.ndarray):
        return value.tolist()
    return list(value) if isinstance(value, tuple) else value


def restored(description: Any) -> Any:
    """Return the object of a description by `described`.

    Raises:
        ValueError: this is no such description.
    """
    if not isinstance(description, dict):
        return tuple(description) if isinstance(description, list) else description
    kind = _public(description.get("type"))
    names = [field.name for field in fields(kind) if field.name != "spring" or "spring" in description]
    values = {name: restored(description[name]) for name in names}
    # Classes with a constructor of their own take their fields in order, perhaps under other names.
    return kind(**values) if kind.__dataclass_params__.init else kind(*values.values())


def _public(name: Any, kind: type | None = None) -> type:
    for module in _VOCABULARY:
        found = vars(module).get(name) if isinstance(name, str) else None
        if isinstance(found, type) and is_dataclass(found) and kind in (None, found):
            return found
    raise ValueError(f"scenes and protocols must be made of the public classes of bem; received {shown(name)}")
