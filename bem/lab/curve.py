"""A force curve in SI units, simulated or measured.

Time in s, indentation and contact radius in m, force in N. `force_sign` says which force is positive: "tension", as
everywhere in `bem`, or "compression", as on most indenters. Indentation is positive into the half-space.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from bem._support.tabular import Column, Tabular
from bem._support.validation import FloatArray, finite_vector
from bem._support.wording import shown
from bem.lab.contact_point import Contact, find_contact

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bem.lab.units import Quantity

ForceSign = Literal["tension", "compression"]
SIGNS = ("tension", "compression")


def require_sign(force_sign: str) -> None:
    """Raise a `ValueError` unless the sign is 'tension' or 'compression'."""
    if force_sign not in SIGNS:
        raise ValueError(f"force_sign must be 'tension' or 'compression'; received {shown(force_sign)}")


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ForceCurve(Tabular):
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
    def stiffness(self) -> float | None:
        """Stiffness, in N/m, of the spring that stage, indentation and force belong to; `None` without a stage."""
        if self.stage is None:
            return None
        stretched = self.indentation - self.stage
        stretched = stretched - stretched.mean()
        square, product = float(stretched @ stretched), float(stretched @ self.tension)
        return product / square if product > 0.0 else None

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
        return find_contact(self)

    def columns(self) -> dict[str, Column]:
        """The columns of `write`, `to_dataframe` and `to_xarray`, with their units."""
        columns = {
            "time": Column(self.time, "s"),
            "indentation": Column(self.indentation, "m"),
            "force": Column(self.force, "N"),
        }
        further = {"contact_radius": self.contact_radius, "stage": self.stage}
        return columns | {name: Column(values, "m") for name, values in further.items() if values is not None}

    def facts(self) -> dict[str, str]:
        """Number of points, duration, deepest indentation, pull-off force and sign, as texts."""
        from matplotlib.ticker import EngFormatter

        values = {
            "duration": (self.time[-1] - self.time[0], "s"),
            "deepest indentation": (self.indentation.max(), "m"),
            "pull-off force": (self.pull_off_force, "N"),
        }
        shown = {name: EngFormatter(unit, places=2)(float(value)) for name, (value, unit) in values.items()}
        return {"points": str(len(self)), **shown, "positive": self.force_sign}

    def summary(self) -> dict[str, Any]:
        """Pull-off force in N, and which force is positive."""
        return {"pull_off_force": self.pull_off_force, "force_sign": self.force_sign}

    def plot(self, *, over_time: Literal["force", "indentation"] = "force") -> Figure:
        """Draw the force against indentation, and beside it force or indentation against time, into a new figure."""
        from matplotlib.figure import Figure
        from matplotlib.ticker import EngFormatter

        figure = Figure(figsize=(9.0, 3.8), layout="constrained")
        panels = figure.subplots(1, 2)
        names = {"force": f"force, {self.force_sign} positive"}
        for axes, across, up in zip(panels, ("time", "indentation"), (over_time, "force"), strict=True):
            axes.axhline(0.0, color="0.8", linewidth=0.8)
            axes.plot(*(self.columns()[name].values for name in (across, up)), color="#0072B2", linewidth=1.2)
            for axis, name in ((axes.xaxis, across), (axes.yaxis, up)):
                axis.set_major_formatter(EngFormatter(self.columns()[name].unit))
                axis.set_label_text(names.get(name, name))
            # Labels with units are wide.
            axes.locator_params(axis="x", nbins=5)
            axes.spines[["top", "right"]].set_visible(False)
        return figure

    def write(self, path: str | Path) -> None:
        """Write a CSV that `read` understands: columns `time (s)`, `indentation (m)`, `force (N)`, and further ones.

        Raises:
            ValueError: the place cannot be written.
        """
        from bem._support.outputs import whole_file

        columns = {f"{name} ({column.unit})": column.values for name, column in self.columns().items()}
        with whole_file(path) as part:
            np.savetxt(
                part,
                np.column_stack(list(columns.values())),
                delimiter=",",
                header=",".join(columns),
                comments="",
                fmt="%.9g",
            )
