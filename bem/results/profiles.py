"""Profiles of a contact: gap, traction and displacement over the radius, at chosen instants of a trajectory.

Units: radius in beta, gap and displacement in h0, traction in dgamma / h0 (positive in tension), force in pi R dgamma.
The force is the integral of 2 mu traction r dr over the profile and the far field beyond it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from bem._support.tabular import UNITS, labelled
from bem._support.validation import FloatArray, real_array
from bem._support.wording import shown
from bem.problem.indenter import PARABOLOID

if TYPE_CHECKING:
    import xarray as xr

MOST_PROFILES = 10_000
_UNITS = {"radius": "beta", "gap": "h0", "displacement": "h0", "traction": "dgamma / h0"}


@dataclass(frozen=True)
class Profiles:
    """p profiles on up to n nodes each; the nodes follow the edge of the contact, so that each profile has its own.

    Where a profile has fewer than n nodes, its rows end with NaN.
    """

    time: FloatArray
    """(p,)"""
    indentation: FloatArray
    """(p,) of the sphere."""
    force: FloatArray
    """(p,)"""
    radius: FloatArray
    """(p, n)"""
    gap: FloatArray
    """(p, n), 1 at the equilibrium of two flat surfaces."""
    traction: FloatArray
    """(p, n)"""
    tabor: float
    exponent: float = PARABOLOID
    """Of the indenter."""

    def __len__(self) -> int:
        return len(self.time)

    @property
    def sphere(self) -> FloatArray:
        """(p, n): height of the indenter's surface over the flat surface of the half-space, in h0."""
        return self.height(self.indentation[:, None], self.radius)

    def height(self, indentation: ArrayLike, radius: FloatArray) -> FloatArray:
        """Height of the indenter at an indentation and at radii, of their broadcast shape."""
        return 1.0 - np.asarray(indentation) + self.tabor / self.exponent * np.abs(radius) ** self.exponent

    @property
    def displacement(self) -> FloatArray:
        """(p, n): displacement of the half-space's surface, positive into the solid."""
        return self.gap - self.sphere

    def _variables(self) -> dict[str, tuple[str | tuple[str, str], FloatArray, str]]:
        along = {name: ("profile", getattr(self, name), UNITS[name]) for name in ("time", "indentation", "force")}
        return along | {name: (("profile", "node"), getattr(self, name), unit) for name, unit in _UNITS.items()}

    def to_xarray(self) -> xr.Dataset:
        """The profiles as an `xarray.Dataset` of dimensions `profile` and `node`, each variable with its `units`.

        Raises:
            ImportError: xarray is not installed.
        """
        return labelled(self._variables(), {"tabor": self.tabor, "exponent": self.exponent})

    def to_hdf5(self, path: str | Path) -> None:
        """Write the profiles to a new HDF5 file: one data set a variable, with the attribute `units`."""
        import h5py

        from bem._support.outputs import Outputs

        with Outputs(Path(path)) as outputs, outputs.write(Path(path)) as temporary, h5py.File(temporary, "w") as file:
            file.attrs["tabor"], file.attrs["exponent"] = self.tabor, self.exponent
            for name, (_, values, unit) in self._variables().items():
                file.create_dataset(name, data=values).attrs["units"] = unit


def checked_instants(instants: ArrayLike, times: FloatArray) -> FloatArray:
    """Instants of profiles, of shape (p,), for a protocol of the given `times`.

    Raises:
        ValueError: there are none or too many, they do not increase, or lie outside the protocol.
    """
    checked = real_array("profiles", instants)
    if not (checked.ndim == 1 and 0 < checked.size <= MOST_PROFILES and np.all(np.diff(checked) > 0.0)):
        raise ValueError(
            f"profiles must be 1 to {MOST_PROFILES} increasing instants, or their number; received {shown(instants)}"
        )
    if not (times[0] <= checked[0] and checked[-1] <= times[-1]):
        raise ValueError(
            f"profiles must lie within the protocol, from {times[0]:.6g} to {times[-1]:.6g}; received instants from "
            f"{checked[0]:.6g} to {checked[-1]:.6g}"
        )
    return checked


def axis_of_phases(trajectory: Any) -> tuple[FloatArray, FloatArray]:
    """Instants (s,) at which the phases of a trajectory begin, and the end, and their `places_of`."""
    return trajectory.corners, places_of(trajectory.corners)


def places_of(corners: FloatArray) -> FloatArray:
    """Places (s,) of instants between 0 and 1: half of the axis is shared equally by the phases, half by durations."""
    durations = np.diff(corners)
    widths = 0.5 / max(len(durations), 1) + 0.5 * durations / max(durations.sum(), 1e-300)
    return np.insert(np.cumsum(widths), 0, 0.0)


def moments(trajectory: Any) -> dict[str, float]:
    """Instants that tell the story of a contact, by name, in their order; those that it does not have are left out."""
    time, touching = trajectory.time, trajectory.contact_radius > 0.0
    instants = {"apart" if not touching[0] else "start": time[0]}
    if touching.any() and not touching[0]:
        instants["first contact"] = time[np.argmax(touching)]
    stage = trajectory.stage
    deepest = touching & (stage >= stage.max() - 1e-9 * np.ptp(stage))
    if deepest.any():
        first = int(np.argmax(deepest))
        last = first + int(np.argmin(np.append(deepest[first:], False))) - 1
        instants["pressed"] = time[first]
        if trajectory.unloading[last] and time[last] > time[first]:
            instants["relaxed"] = time[last]
    if trajectory.pull_off_force > 0.0:
        instants["pull-off" if trajectory.detached else "largest tension"] = trajectory.pull_off_time
    instants["released" if trajectory.detached else "end"] = time[-1]
    named = {float(at): name for name, at in reversed(instants.items())}  # of two at one instant, the former
    return {named[at]: at for at in sorted(named)}


def informative_instants(trajectory: Any, count: int) -> FloatArray:
    """Instants of a trajectory, about `count`, dense where its force changes, its `moments` among them.

    They are equally spaced along the curve of force, indentation and phase, each over its range.
    """
    curve = [np.interp(trajectory.time, *axis_of_phases(trajectory))]
    for values in (trajectory.force, trajectory.indentation):
        extent = float(np.ptp(values))
        curve.append(values / extent if extent > 0.0 else values)
    length = np.insert(np.cumsum(np.linalg.norm(np.diff(curve), axis=0)), 0, 0.0)
    named = list(moments(trajectory).values())
    # A jump takes length but no time.
    instants = np.interp(np.linspace(0.0, length[-1], max(count - len(named), 2)), length, trajectory.time)
    return np.unique(np.concatenate([instants, named]))
