"""An experiment in SI units: the sphere, the solid, their adhesion, and what they are in the solver's units.

With R the radius, dgamma the work of adhesion, E0* = E0 / (1 - nu^2) and h0 the equilibrium gap, the solver measures

    indentation in h0,  force in pi R dgamma,  time in retardation times,  stiffness in pi R dgamma / h0,
    contact radius in beta = (R^2 dgamma / E0*)^(1/3),

and the only remaining parameter is the Tabor parameter mu = (R dgamma^2 / (E0*^2 h0^3))^(1/3). Source: paper, Methods.

Surfaces attract over a few angstroms, so that a soft sphere of micrometres has a Tabor parameter of hundreds, beyond
what a mesh resolves. `simulate` answers it all the same. What needs a mesh, such as a film of the contact, or knows
small Tabor parameters only, such as a surrogate, can take a longer gap h0, an effective range at which the Tabor
parameter is `largest_tabor`.

- In an elastic contact it is a numerical choice. The force curve in newtons and metres no longer depends on it once mu
  is large, in the JKR limit.
- In a viscoelastic contact it is a length of the material. The edge of the contact dissipates at the frequency at which
  it crosses the cohesive zone, so that a longer range acts like a shorter retardation time at the edge, though not in
  the bulk. A pull-off force that depends on speed depends on the range too, and a fitted retardation time belongs to
  it. `Setup.simulate` and `Setup.predict` warn.
"""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bem._support.validation import collected, finite_number, instance
from bem._support.wording import shown
from bem.lab.curve import ForceCurve
from bem.lab.units import ForceSign, Quantity, readable, require_sign, to_si
from bem.problem.materials import Elastic, PronySeries, StandardLinearSolid
from bem.problem.protocol import ForceProtocol, LoadingProtocol, Protocol, default_start_indentation
from bem.problem.scene import LARGEST_TABOR, Scene

INTERATOMIC_GAP = 0.3e-9
"""The equilibrium gap, in m, of a setup that names none: of the order of interatomic distances."""

EFFECTIVE_TABOR = 3.0
"""Tabor parameter of an effective range, at which a mesh resolves the edge of the contact."""

_POSITIVE = {"above": 0.0}
_QUANTITIES: dict[str, tuple[str, dict[str, float]]] = {
    "radius": ("length", _POSITIVE),
    "work_of_adhesion": ("energy per area", _POSITIVE),
    "relaxed_modulus": ("pressure", _POSITIVE),
    "equilibrium_gap": ("length", _POSITIVE),
    "retardation_time": ("time", _POSITIVE),
    "stiffness": ("stiffness", _POSITIVE),
    "thickness": ("length", _POSITIVE),
    "poisson_ratio": ("number", {"low": 0.0, "high": 0.5}),
    "largest_tabor": ("number", {"low": 0.05, "high": LARGEST_TABOR}),
    "half_angle": ("number", {"above": 0.0, "high": 89.0}),
}
_OPTIONAL = ("retardation_time", "stiffness", "thickness", "half_angle")


class EffectiveRangeWarning(UserWarning):
    """A viscoelastic contact at an effective range of adhesion, which stands in for one too short to resolve."""


@dataclass(frozen=True, kw_only=True)
class Setup:
    """A sphere on a half-space, in SI units: plain numbers, or text with a unit such as "50 um".

    Args:
        radius: of the sphere, in m.
        work_of_adhesion: thermodynamic work of adhesion dgamma, in J/m^2.
        relaxed_modulus: Young's modulus E0 of the half-space after all relaxation, in Pa.
        poisson_ratio: from 0 to 0.5; soft solids are nearly incompressible.
        equilibrium_gap: h0, the gap at which the surfaces neither attract nor repel each other, in m. The gap in use is
            `gap`, which is longer where the Tabor parameter would exceed `largest_tabor`.
        retardation_time: the unit of the material's times, in s. Required for a `StandardLinearSolid`, whose
            retardation time it is. A `PronySeries` without it has its times in seconds.
        material: `Elastic()`, `StandardLinearSolid(...)` or `PronySeries(...)`.
        largest_tabor: Tabor parameter above which an effective range is used, none by default; see `bem.lab.setup`.
        stiffness: of a spring between stage and sphere, such as a cantilever, in N/m; infinite: none.
        half_angle: between axis and flank of a cone, in degrees, for the model of `bem.lab.fit` that presses one
            instead of a sphere.
        thickness: of a layer that is bonded to a rigid ground, in m, for the models of `bem.lab.fit` that know one:
            Hertz, DMT and Ting.

    Raises:
        ValueError: naming each such quantity, what is allowed and what was received.
    """

    radius: float
    work_of_adhesion: float
    relaxed_modulus: float
    poisson_ratio: float = 0.5
    equilibrium_gap: float = INTERATOMIC_GAP
    retardation_time: float | None = None
    material: Elastic | StandardLinearSolid | PronySeries = dataclasses.field(default_factory=Elastic)
    largest_tabor: float = LARGEST_TABOR
    stiffness: float | None = None
    half_angle: float | None = None
    thickness: float | None = None

    if TYPE_CHECKING:  # text and Pint quantities go in, plain numbers come out

        def __init__(
            self,
            *,
            radius: Quantity,
            work_of_adhesion: Quantity,
            relaxed_modulus: Quantity,
            poisson_ratio: Quantity = 0.5,
            equilibrium_gap: Quantity = INTERATOMIC_GAP,
            retardation_time: Quantity | None = None,
            material: Elastic | StandardLinearSolid | PronySeries = ...,
            largest_tabor: float = LARGEST_TABOR,
            stiffness: Quantity | None = None,
            half_angle: float | None = None,
            thickness: Quantity | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        mistakes: list[str] = []
        with collected(mistakes):
            instance("material", self.material, (Elastic, StandardLinearSolid, PronySeries))
            if self.retardation_time is None and isinstance(self.material, StandardLinearSolid):
                raise ValueError("retardation_time must be given for a StandardLinearSolid; received None")
        for name, (dimension, limits) in _QUANTITIES.items():
            if getattr(self, name) is None and name in _OPTIONAL:
                continue
            with collected(mistakes):
                number = to_si(name, getattr(self, name), dimension)
                rigid = name == "stiffness" and number == np.inf
                object.__setattr__(self, name, None if rigid else finite_number(name, number, **limits))
        if not mistakes and not self.tabor >= 1e-6:
            mistakes.append(f"the Tabor parameter of a setup must be at least 1e-06; received {self.tabor:.3g}")
        if mistakes:
            raise ValueError("; ".join(mistakes))

    @property
    def contact_modulus(self) -> float:
        """E0* = E0 / (1 - nu^2), in Pa."""
        return self.relaxed_modulus / (1.0 - self.poisson_ratio**2)

    @property
    def adhesion_length(self) -> float:
        """(R dgamma^2 / E0*^2)^(1/3), in m: how far adhesion stretches the surface, mu times h0."""
        return float(np.cbrt(self.radius * (self.work_of_adhesion / self.contact_modulus) ** 2))

    @property
    def physical_tabor(self) -> float:
        """Tabor parameter with the equilibrium gap as given."""
        return self.adhesion_length / self.equilibrium_gap

    @property
    def tabor(self) -> float:
        """Tabor parameter simulated, at most `largest_tabor`."""
        return min(self.physical_tabor, self.largest_tabor)

    @property
    def gap(self) -> float:
        """The gap h0 simulated, in m: the equilibrium gap, or the effective range."""
        return self.adhesion_length / self.tabor

    @property
    def range_is_effective(self) -> bool:
        """Whether `gap` is longer than the equilibrium gap."""
        return self.physical_tabor > self.largest_tabor

    @property
    def force_scale(self) -> float:
        """The product pi R dgamma, in N."""
        return float(np.pi * self.radius * self.work_of_adhesion)

    indentation_scale = gap
    """The gap h0 simulated, in m."""

    @property
    def time_scale(self) -> float:
        """The retardation time, in s; 1 s where the material has none or its times are in seconds."""
        return 1.0 if self.retardation_time is None else self.retardation_time

    @property
    def contact_radius_scale(self) -> float:
        """The length beta = (R^2 dgamma / E0*)^(1/3), in m."""
        return float(np.cbrt(self.radius**2 * self.work_of_adhesion / self.contact_modulus))

    @property
    def speed_scale(self) -> float:
        """h0 per retardation time, in m/s."""
        return self.indentation_scale / self.time_scale

    @property
    def regime(self) -> str:
        """The limit of elastic theory this contact is near, by the physical Tabor parameter."""
        if self.physical_tabor >= 5.0:
            return "JKR: short-range adhesion"
        return "DMT: long-range adhesion" if self.physical_tabor <= 0.1 else "between DMT and JKR"

    @property
    def stiffness_scale(self) -> float:
        """The stiffness pi R dgamma / h0, in N/m."""
        return self.force_scale / self.gap

    def scene(self) -> Scene:
        """The contact in the solver's units."""
        spring = None if self.stiffness is None else self.stiffness / self.stiffness_scale
        return Scene(tabor=self.tabor, material=self.material, spring=spring)

    def protocol(
        self,
        *,
        peak_indentation: Quantity,
        loading_rate: Quantity,
        dwell_time: Quantity = 0.0,
        unloading_rate: Quantity,
        start_indentation: Quantity | None = None,
    ) -> LoadingProtocol:
        """One cycle of loading, dwell and unloading in the solver's units.

        Args:
            peak_indentation: in m; with a spring, indentations and speeds are those of the stage.
            loading_rate, unloading_rate: speeds, in m/s.
            dwell_time: in s.
            start_indentation: in m; by default -pi^(2/3) `adhesion_length`, where adhesion is still weak, and with a
                spring as much further as 2 pi R dgamma, the largest elastic adhesion, stretches it.

        Returns:
            The protocol for `Setup.simulate`, with dimensionless quantities.
        """
        start = None
        if start_indentation is not None:
            start = to_si("start_indentation", start_indentation, "length") / self.gap
        elif self.stiffness is not None:
            start = default_start_indentation(self.tabor) - 2.0 * self.stiffness_scale / self.stiffness
        quantities = {
            "peak_indentation": to_si("peak_indentation", peak_indentation, "length") / self.gap,
            "loading_rate": to_si("loading_rate", loading_rate, "speed") / self.speed_scale,
            "dwell_time": to_si("dwell_time", dwell_time, "time") / self.time_scale,
            "unloading_rate": to_si("unloading_rate", unloading_rate, "speed") / self.speed_scale,
        }
        try:
            protocol = LoadingProtocol(**quantities, start_indentation=start)
            protocol.history(self.tabor)
        except ValueError as error:
            raise ValueError(f"{error} (in {readable(self.gap, 'm')} and {readable(self.time_scale, 's')})") from error
        return protocol

    def force_protocol(
        self,
        *,
        times: Sequence[Quantity],
        forces: Sequence[Quantity],
        force_sign: ForceSign = "tension",
    ) -> ForceProtocol:
        """A force that is linear between `times` (s), at which it is `forces` (N), in the solver's units."""
        require_sign(force_sign)
        scale = self.force_scale if force_sign == "tension" else -self.force_scale
        return ForceProtocol(
            [to_si("times", time, "time") / self.time_scale for time in times],
            [to_si("forces", force, "force") / scale for force in forces],
        )

    def simulate(
        self,
        protocol: Protocol,
        accuracy: str | float = "standard",
        *,
        force_sign: ForceSign = "tension",
    ) -> ForceCurve:
        """Simulate a protocol of `protocol(...)` or `force_protocol(...)` and give the force curve in SI.

        Args:
            protocol, accuracy: as for `bem.simulate`.
            force_sign: which force is positive. Adhesion is tension; laboratories often count compression.

        Returns:
            The force curve, in m, N and s, with forces in the sign `force_sign`.

        Raises:
            ValueError: for an invalid protocol, accuracy or sign.
            RuntimeError: the simulation did not complete; the message says why.
        """
        from bem.simulation import simulate

        require_sign(force_sign)
        trajectory = simulate(self.scene(), protocol, accuracy)
        if not trajectory.completed:
            raise RuntimeError(f"the simulation did not complete: {trajectory.status}")
        return self._in_si(trajectory, force_sign)

    def predict(
        self,
        protocol: LoadingProtocol,
        model: Any,
        *,
        coverage: float = 0.9,
        force_sign: ForceSign = "tension",
    ) -> ForceCurve:
        """Predict what `simulate` would, with a surrogate: `setup.predict(protocol, "accurate")`.

        Args:
            protocol: of `protocol(...)`.
            model: a loaded surrogate, or the name of one, which is then loaded for this call.
            coverage: share of true forces that the band of the curve is to contain, of a model that has one.
            force_sign: as for `simulate`.

        Returns:
            The force curve, with `force_lower`, `force_upper` and `pull_off_interval` of a model with bands.

        Raises:
            ValueError: an argument is invalid, or the model does not know the scene, such as one with a spring.
        """
        require_sign(force_sign)
        if isinstance(model, str):
            from importlib.metadata import entry_points

            for package in [*entry_points(group="bem.surrogates")][:1]:
                model = package.load()(model)
        if not hasattr(model, "predict"):
            raise ValueError(f"model must be a surrogate or the name of one; received {shown(model)}")
        # A model of the paper knows no intervals.
        options = {"coverage": coverage} if getattr(model, "any_solid", False) else {}
        trajectory = model.predict(self.scene(), protocol, **options)
        return self._in_si(trajectory, force_sign)

    def _in_si(self, trajectory: Any, force_sign: ForceSign) -> ForceCurve:
        """A trajectory in SI; a warning, at the caller's caller, where it depends on the effective range."""
        if self.range_is_effective and not isinstance(self.material, Elastic):
            warnings.warn(
                f"a viscoelastic contact depends on the effective range of adhesion, {readable(self.gap, 'm')} in "
                f"place of {readable(self.equilibrium_gap, 'm')}; a largest_tabor above {self.tabor:g} is nearer",
                EffectiveRangeWarning,
                stacklevel=3,
            )
        names = ("accuracy", "detached", "model", "coverage", "force_lower", "force_upper", "pull_off_interval")
        extra = {name: getattr(trajectory, name) for name in names if getattr(trajectory, name, None) is not None}
        extra |= {name: extra[name] * self.force_scale for name in ("force_lower", "force_upper") if name in extra}
        if "pull_off_interval" in extra:
            extra["pull_off_interval"] = tuple(end * self.force_scale for end in extra["pull_off_interval"])
        radius = trajectory.contact_radius
        curve = ForceCurve(
            time=trajectory.time * self.time_scale,
            indentation=trajectory.indentation * self.gap,
            force=trajectory.force * self.force_scale,
            contact_radius=radius * self.contact_radius_scale if np.all(np.isfinite(radius)) else None,
            stage=None if self.stiffness is None else trajectory.stage * self.gap,
            **extra,
        )
        return curve.with_sign(force_sign)

    def replaced(self, **changes: Any) -> Setup:
        """The same setup with some quantities changed; `modulus_ratio` stands for a standard linear solid of it."""
        ratio = changes.pop("modulus_ratio", None)
        if ratio is not None:
            changes["material"] = StandardLinearSolid(modulus_ratio=ratio)
        unknown = sorted(set(changes) - {entry.name for entry in dataclasses.fields(self)})
        if unknown:
            raise ValueError(f"the names must be quantities of a setup; received {shown(unknown)}")
        return dataclasses.replace(self, **changes)
