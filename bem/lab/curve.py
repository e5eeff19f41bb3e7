"""A force curve in SI units, simulated or measured.

Time in s, indentation and contact radius in m, force in N. `force_sign` says which force is positive: "tension", as
everywhere in `bem`, or "compression", as on most indenters. Indentation is positive into the half-space.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from bem._support.tabular import Column, Tabular
from bem._support.validation import FloatArray, finite_number, finite_vector, instance
from bem.lab.contact_point import Contact, find_contact
from bem.lab.units import ForceSign, Quantity, readable, require_sign, to_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_BAND = ("force_lower", "force_upper")
_LARGEST = 1e15  # in SI, of any number that is measured
_UNITS = {
    "time": "s",
    "indentation": "m",
    "force": "N",
    "contact_radius": "m",
    "stage": "m",
    **dict.fromkeys(_BAND, "N"),
}


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
        force_lower, force_upper: band of each force of a prediction, in N, infinite outside the training; else `None`.
        pull_off_interval: band of its pull-off force, in N, positive in tension; else `None`.
        detached: whether the contact had ended by the last point; without a word of it, whether its contact radius had,
            or `None` where that was not measured.
        accuracy: relative error to be expected of a simulated curve.
        model: name of the model that predicted the curve.
        coverage: share of true forces that its band is to contain.
        notes: sentences on how a file was read.

    Raises:
        ValueError: fewer than two points, values beyond 1e15 or not finite, unequal lengths, or times that go back.
    """

    time: FloatArray
    indentation: FloatArray
    force: FloatArray
    contact_radius: FloatArray | None = None
    force_sign: ForceSign = "tension"
    stage: FloatArray | None = None
    force_lower: FloatArray | None = None
    force_upper: FloatArray | None = None
    pull_off_interval: tuple[float, float] | None = None
    detached: bool | None = None
    accuracy: float | None = None
    model: str = ""
    coverage: float | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_sign(self.force_sign)
        optional = [name for name in ("contact_radius", "stage") if getattr(self, name) is not None]
        for name in ("time", "indentation", "force", *optional):
            values = finite_vector(name, getattr(self, name), at_least=2)
            if (largest := float(np.abs(values).max())) > _LARGEST:
                raise ValueError(f"{name} must be at most {_LARGEST:g} in {_UNITS[name]}; received {largest:g}")
            object.__setattr__(self, name, values)
        lengths = {name: len(getattr(self, name)) for name in ("time", "indentation", "force", *optional)}
        if len(set(lengths.values())) > 1:
            raise ValueError(f"the columns of a force curve must have the same length; received {lengths}")
        if self.detached is None and self.contact_radius is not None:
            object.__setattr__(self, "detached", bool(self.contact_radius[-1] == 0.0))
        back = np.flatnonzero(np.diff(self.time) < 0.0)
        if back.size:
            raise ValueError(
                f"time must not decrease; received {self.time[back[0]]:g} s followed by {self.time[back[0] + 1]:g} s"
            )

    @staticmethod
    def read(
        path: str | Path | Sequence[str | Path],
        *,
        stiffness: Quantity | None = None,
        force_sign: ForceSign | None = None,
        columns: Mapping[str, str] | None = None,
        speed: Quantity | None = None,
        number: int | None = None,
        sensitivity: Quantity | None = None,
    ) -> ForceCurve:
        """Read a measured curve; `bem.lab.reading` says how columns are named.

        Args:
            path: A CSV file, an AFM file, or approach and retract as two CSV files.
            stiffness: Of cantilever or machine, in N/m. It turns the stage's displacement into indentation:
                displacement minus compression over stiffness. Required where the file has no indentation.
            force_sign: Which force the file counts as positive; by default compression, as instruments do, and tension
                where a column is called tension.
            columns: What a column that is named otherwise holds, for example `{"F_n (mN)": "force (mN)"}`.
            speed: Of the stage, in m/s, for files without time.
            number: Of the curve, from 0, in a file of several.
            sensitivity: Of the deflection, in m/V, for AFM files that hold volts.

        Returns:
            The curve in SI, in the file's sign; its stage and contact radius where they are known.

        Raises:
            ValueError: the file holds several curves and no `number` is given, a column is missing, a unit does not
                fit, a number cannot be read, or the force grows the wrong way.
            FileNotFoundError: there is no such file.
        """
        from bem.lab.reading import raw_curves

        require_sign(force_sign or "compression")
        spring, rate, volts = (
            None if value is None else finite_number(name, to_si(name, value, name), above=0.0)
            for name, value in (("stiffness", stiffness), ("speed", speed), ("sensitivity", sensitivity))
        )
        names = [path] if isinstance(path, str | Path) else instance("path", path, (str, Path, list, tuple))
        if not names:
            raise ValueError("path must name at least one file; received none")
        paths = [Path(instance("path", file_name, (str, Path))) for file_name in names]
        where = " and ".join(map(str, paths))
        if len({file_name.resolve() for file_name in paths}) < len(paths):
            raise ValueError(f"the files of one curve must be different; received {where}")
        curves, sign = raw_curves(paths, spring, force_sign, columns or {}, volts)
        if number is None and len(curves) > 1:
            raise ValueError(
                f"the number of a curve must be given, from 0 to {len(curves) - 1}; received {where}, which holds "
                f"{len(curves)} of them"
            )
        if not 0 <= (number or 0) < len(curves):
            raise ValueError(f"the number of a curve in {where} must be from 0 to {len(curves) - 1}; received {number}")
        return ForceCurve(**curves[number or 0].columns(where, rate, sign))

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

    @property
    def hysteresis(self) -> float:
        """Area |closed integral of force d(indentation)| of the loop, in J."""
        return abs(float(0.5 * (self.force[1:] + self.force[:-1]) @ np.diff(self.indentation)))

    def with_sign(self, force_sign: ForceSign) -> ForceCurve:
        """The same curve in the other convention."""
        if force_sign == self.force_sign:
            return self
        lower, upper = (None if band is None else -band for band in (self.force_upper, self.force_lower))
        return dataclasses.replace(self, force=-self.force, force_lower=lower, force_upper=upper, force_sign=force_sign)

    def shifted(self, *, contact_point: float = 0.0, force_offset: float = 0.0) -> ForceCurve:
        """The curve with its indentation counted from `contact_point` (m) and its force from `force_offset` (N)."""
        shift = {"indentation": contact_point, "stage": contact_point}
        shift |= dict.fromkeys(("force", *_BAND), force_offset)
        columns = {name: getattr(self, name) - by for name, by in shift.items() if getattr(self, name) is not None}
        return dataclasses.replace(self, **columns)

    def contact(self) -> Contact:
        """Baseline, noise and contact point, as the approach shows them; see `bem.lab.contact_point`."""
        return find_contact(self.indentation, self.force)

    def columns(self) -> dict[str, Column]:
        """The columns of `write`, `to_dataframe` and `to_xarray`, with their units."""
        columns = {name: Column(getattr(self, name), unit) for name, unit in _UNITS.items()}
        return {name: column for name, column in columns.items() if column.values is not None}

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
        """Pull-off force in N, hysteresis in J, which force is positive, and of a prediction the pull-off interval."""
        values = {name: getattr(self, name) for name in ("pull_off_force", "hysteresis", "force_sign")}
        interval = self.pull_off_interval
        return values if interval is None else values | {"pull_off_interval": list(interval)}

    def plot(self, *, over_time: Literal["force", "indentation"] = "force") -> Figure:
        """Draw the force against indentation, and beside it force or indentation against time, into a new figure.

        The phases up to the deepest indentation, at it and after it have widths of their own.
        """
        from matplotlib.ticker import EngFormatter

        from bem.results.plots import STRETCHED, Line, Top, colour_of, draw_curve, top_label

        units = {name: EngFormatter(unit) for name, unit in _UNITS.items()}
        deepest = np.flatnonzero(self.indentation >= self.indentation.max() - 1e-6 * np.ptp(self.indentation))
        corners = np.unique(self.time[[0, deepest[0], deepest[-1], -1]])
        at = deepest[-1] + int(np.argmax(self.tension[deepest[-1] :]))
        largest = readable(float(self.tension[at]), "N").replace(" u", " µ")
        label = f"{top_label(self.detached)} {largest}"
        top = Top(self.time[at], self.indentation[at], self.force[at], label, bool(self.detached))
        labels = {"time": f"time{STRETCHED * (len(corners) > 2)}", "indentation": "indentation"}
        labels |= {"force": f"force, {self.force_sign} positive"}
        band = None if self.force_lower is None or self.force_upper is None else (self.force_lower, self.force_upper)
        look = (self.model, colour_of(self.model), band, self.coverage)
        line = Line(self.time, self.indentation, self.force, *look)
        marked = top if self.tension[at] > 0.0 else None
        return draw_curve([line], corners, labels, over_time=over_time, top=marked, units=units.__getitem__)

    def write(self, path: str | Path) -> None:
        """Write a CSV that `read` understands: columns `time (s)`, `indentation (m)`, `force (N)`, and further ones.

        A force that is positive in tension is called `tension (N)`.

        Raises:
            ValueError: the place cannot be written.
        """
        from bem._support.outputs import whole_file

        titles = {"force": self.force_sign if self.force_sign == "tension" else "force"}
        columns = {f"{titles.get(n, n)} ({column.unit})": column.values for n, column in self.columns().items()}
        with whole_file(path) as temporary:
            table = np.column_stack(list(columns.values()))
            np.savetxt(temporary, table, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
