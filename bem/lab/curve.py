"""A force curve in SI units, simulated or measured.

Time in s, indentation and contact radius in m, force in N. `force_sign` says which force is positive: "tension", as
everywhere in `bem`, or "compression", as on most indenters. Indentation is positive into the half-space.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from bem._support.validation import FloatArray, finite_vector
from bem._support.wording import shown

if TYPE_CHECKING:
    from bem.lab.contact_point import Contact
    from bem.lab.units import Quantity

ForceSign = Literal["tension", "compression"]
SIGNS = ("tension", "compression")


def require_sign(force_sign: str) -> None:
    """Refuse what is no sign convention."""
    if force_sign not in SIGNS:
        raise ValueError(f"force_sign must be 'tension' or 'compression'; received {shown(force_sign)}")


@dataclass(frozen=True, eq=False, kw_only=True)
class ForceCurve:
    """Force against time and indentation, in arrays of equal length.

    Args:
        time: in s, not decreasing; a simulated jump has two entries at one time.
        indentation: of the sphere, in m, positive into the half-space.
        force: in N.
        contact_radius: in m; `None` where it was not measured.
        force_sign: which force is positive.
        stage: displacement of the stage behind a spring, in m: indentation plus compression over stiffness; `None`
            where there is no spring.

    Raises:
        ValueError: fewer than two points, values that are not finite, unequal lengths, or times that go back.
    """

    time: FloatArray
    indentation: FloatArray
    force: FloatArray
    contact_radius: FloatArray | None = None
    force_sign: ForceSign = "tension"
    stage: FloatArray | None = None

    def __post_init__(self) -> None:
        require_sign(self.force_sign)
        names = ["time", "indentation", "force"]
        names += [name for name in ("contact_radius", "stage") if getattr(self, name) is not None]
        for name in names:
            object.__setattr__(self, name, finite_vector(name, getattr(self, name), at_least=2))
        lengths = {name: len(getattr(self, name)) for name in names}
        if len(set(lengths.values())) > 1:
            raise ValueError(f"the columns of a force curve must have the same length; received {lengths}")
        back = np.flatnonzero(np.diff(self.time) < 0.0)
        if back.size:
            raise ValueError(
                f"time must not decrease; received {self.time[back[0]]:g} s followed by {self.time[back[0] + 1]:g} s"
            )

    @classmethod
    def read(
        cls,
        path: str | Path,
        *,
        stiffness: Quantity | None = None,
        force_sign: ForceSign = "tension",
        columns: Mapping[str, str] | None = None,
        speed: Quantity | None = None,
    ) -> ForceCurve:
        """Read a measured curve; see `bem.lab.reading.read`."""
        from bem.lab.reading import read

        return read(path, stiffness=stiffness, force_sign=force_sign, columns=columns, speed=speed)

    def __len__(self) -> int:
        return len(self.time)

    @property
    def tension(self) -> FloatArray:
        """The force, positive in tension, whatever `force_sign` is."""
        return self.force if self.force_sign == "tension" else -self.force

    @property
    def pull_off_force(self) -> float:
        """Largest tension after the deepest indentation, in N, always positive in tension."""
        return float(np.max(self.tension[int(np.argmax(self.indentation)) :]))

    def with_sign(self, force_sign: ForceSign) -> ForceCurve:
        """The same curve in the other convention."""
        require_sign(force_sign)
        return dataclasses.replace(
            self, force=self.force if force_sign == self.force_sign else -self.force, force_sign=force_sign
        )

    def shifted(self, *, contact_point: float = 0.0, force_offset: float = 0.0) -> ForceCurve:
        """The curve with its indentation counted from `contact_point` (m) and its force from `force_offset` (N)."""
        stage = None if self.stage is None else self.stage - contact_point
        return dataclasses.replace(
            self, indentation=self.indentation - contact_point, force=self.force - force_offset, stage=stage
        )

    def contact(self) -> Contact:
        """Baseline, noise and contact point, as the approach shows them; see `bem.lab.contact_point`."""
        from bem.lab.contact_point import find_contact

        return find_contact(self)

    def write(self, path: str | Path) -> None:
        """Write a CSV that `read` understands: columns `time (s)`, `indentation (m)`, `force (N)`, and further ones.

        Raises:
            ValueError: the place cannot be written.
        """
        from bem._support.outputs import whole_file

        columns = {"time (s)": self.time, "indentation (m)": self.indentation, "force (N)": self.force}
        if self.contact_radius is not None:
            columns["contact_radius (m)"] = self.contact_radius
        if self.stage is not None:
            columns["stage (m)"] = self.stage
        with whole_file(path) as part:
            np.savetxt(
                part,
                np.column_stack(list(columns.values())),
                delimiter=",",
                header=",".join(columns),
                comments="",
                fmt="%.9g",
            )
