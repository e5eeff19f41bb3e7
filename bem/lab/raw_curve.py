"""What a file holds of one curve, and the force curve that it makes: depth, stage and time from its columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.units import ForceSign

_DEEPEST = (0.2, 0.05)  # parts of the path that tell the sign of the force


@dataclass(frozen=True)
class RawCurve:
    """What a file holds of one curve, in SI, compression positive."""

    quantities: dict[str, FloatArray]
    stiffness: float | None
    """In N/m; `None` where neither file nor user names it."""
    speed: float | None = None
    """In m/s, for a curve without time."""
    position: tuple[float, float] = (np.nan, np.nan)
    """Of the curve in a map, in m; NaN where the file has none."""
    notes: tuple[str, ...] = ()
    """Sentences on how it was read."""

    def columns(self, where: str, speed: float | None = None, force_sign: ForceSign = "compression") -> dict[str, Any]:
        """Of a `ForceCurve`; `speed` (m/s) replaces the file's own, and `where` names it in messages.

        Raises:
            ValueError: a column, the stiffness or the speed is missing, or the force grows the wrong way.
        """
        quantities, compression, spring = self.quantities, self.quantities["force"], self.stiffness
        away = {name: -quantities[name] for name in ("height", "separation") if name in quantities}
        stage, depth = quantities.get("displacement", away.get("height")), away.get("separation")
        depth = quantities.get("indentation", depth)
        if stage is None and depth is None:
            raise ValueError(
                f"a force curve must have an indentation, or a displacement and a stiffness; received {where} with "
                f"{listed(quantities)}"
            )
        if spring is not None:
            stage = depth + compression / spring if stage is None and depth is not None else stage
            depth = None if stage is None else stage - compression / spring
        if depth is None:
            raise ValueError(
                "the spring constant (stiffness, in N/m; --stiffness) must be given, to turn displacement into "
                f"indentation; received none for {where}"
            )
        path = depth if stage is None else stage
        time, speed = quantities.get("time"), speed or self.speed
        if time is None:
            if speed is None:
                raise ValueError(
                    f"a force curve must have a column time, such as 'time (s)', or a speed; received {where} without"
                )
            time = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(path)))]) / speed
        elif time[0] > time[-1]:  # stored from the end on
            order = np.argsort(time, kind="stable")
            time, depth, compression, path = time[order], depth[order], compression[order], path[order]
            stage = None if stage is None else stage[order]
        _check_sign(path, compression, force_sign, where)
        force = compression if force_sign == "compression" else -compression
        notes = (*self.notes, f"Force counted as positive in {force_sign}.")
        radius = quantities.get("contact_radius")
        further = {"contact_radius": radius, "stage": stage, "force_sign": force_sign, "notes": notes}
        return {"time": time, "indentation": depth, "force": force, **further}


def listed(quantities: Mapping[str, FloatArray]) -> str:
    """The columns that were read, in words."""
    return ", ".join(sorted(quantities)) or "no column of a known name"


def _check_sign(path: FloatArray, compression: FloatArray, force_sign: ForceSign, where: str) -> None:
    """Refuse a curve whose tension grows with depth where it is deepest: its sign convention is the other one.

    `path` is the displacement if there is one, since an indentation computed from it follows the force. Both parts of
    the path must agree: a contact that snaps in within one of them has tension that grows there.
    """
    if not np.ptp(path) > 0.0:
        raise ValueError(f"a force curve must move; received {where}, whose path stays at {path[0]:.4g} m")
    approach = np.arange(path.size) <= np.argmax(path)
    agree = []
    for share in _DEEPEST:
        deep = approach & (path > path.max() - share * np.ptp(path))
        depth, tension = path[deep] - path[deep].mean(), compression[deep].mean() - compression[deep]
        together = depth @ tension > 0.8 * np.linalg.norm(depth) * np.linalg.norm(tension) > 0.0
        agree.append(together and np.count_nonzero(deep) >= 3)
    if all(agree):
        opposite = "compression" if force_sign == "tension" else "tension"
        raise ValueError(
            f"the tension in {where} grows with depth, which no contact does; the file was read with "
            f"force_sign={force_sign!r} and should be {opposite!r}"
        )
