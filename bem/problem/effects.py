"""Which effects a scene has, and the same scene without some of them.

Three kinds of effect add cost: adhesion (a law of traction instead of impenetrability), the terms of the material, one
memory vector each, and a spring between stage and sphere; without it the protocol moves the sphere. A term can be left
out in two ways. A fast one has relaxed before anything moves: it is part of the instantaneous compliance then. A slow
one never gets to relax: it drops out of the compliance, and the solid of the terms left over is stiffer. With S the
compliance of the slow terms its relaxed modulus is E0 / (1 - S); force and indentation keep their units, so the stiffer
solid is the scene of Tabor parameter mu (1 - S)^(2/3) with strengths c_i / (1 - S). All terms fast leaves the rubbery
elastic solid, all slow the glassy one, mu k^(2/3). The deformation that the slow terms contribute to the relaxed start
is left out with them; this is about one percent where the protocol starts close to the surface.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bem.problem.negligible_effects import without_terms
from bem.problem.protocol import LoadingProtocol, PiecewiseLinearProtocol
from bem.problem.scene import SMALLEST_TABOR, Scene
from bem.problem.tractions import HardContact

IndentationProtocol = LoadingProtocol | PiecewiseLinearProtocol


@dataclass(frozen=True)
class Effects:
    """The effects kept of a scene whose material has `of` terms.

    Args:
        adhesion: whether surfaces attract each other.
        first, last: terms `first` to `last` - 1 are kept (fastest first); those before have relaxed, those after are
            frozen.
        of: terms of the full material.
        spring: whether there is a spring between stage and sphere.
    """

    adhesion: bool
    first: int
    last: int
    of: int
    spring: bool = False

    @property
    def terms(self) -> int:
        """Terms kept, each of which costs a memory vector."""
        return self.last - self.first

    @property
    def count(self) -> int:
        """Effects kept: terms, and adhesion and the spring as one more each."""
        return self.terms + self.adhesion + self.spring

    @property
    def everything(self) -> bool:
        """Whether no term is left out."""
        return self.terms == self.of

    def __str__(self) -> str:
        adhesion = ("adhesive" if self.adhesion else "without adhesion") + (", with a spring" if self.spring else "")
        if self.of == 0:
            return f"elastic, {adhesion}"
        if self.everything:
            return f"viscoelastic, {adhesion}"
        if self.terms == 0:
            state = "rubbery" if self.first == self.of else "glassy" if self.first == 0 else "partly relaxed"
            return f"elastic {state}, {adhesion}"
        return f"{self.terms} of {self.of} terms, {adhesion}"


def choices(scene: Scene) -> list[Effects]:
    """Every way to keep neighbouring terms of a scene, with or without adhesion and spring, fewest effects first.

    Of as many effects, those with as many terms and the same rest stand side by side. Ways whose stiffer solid would be
    out of the range of Tabor parameters are left out; the full scene is the last.
    """
    of = len(scene.material.strengths)
    adhesion = (False,) if isinstance(scene.adhesion, HardContact) else (False, True)
    kept = [(first, last) for first in range(of + 1) for last in range(first, of + 1)]
    springs = (False,) if scene.spring is None else (False, True)
    stiff = [scene.tabor * (1.0 - scene.material.strengths[last:].sum()) ** (2.0 / 3.0) for last in range(of + 1)]
    combinations = [
        Effects(stick, first, last, of, spring)
        for spring in springs
        for stick in adhesion
        for first, last in kept
        if stiff[last] >= SMALLEST_TABOR
    ]
    return sorted(combinations, key=lambda effects: (effects.count, effects.terms))


def reduced(scene: Scene, protocol: IndentationProtocol, effects: Effects) -> tuple[Scene, IndentationProtocol]:
    """The scene and protocol that simulate `effects` only; the same force and indentation units, the same path.

    A protocol whose start would follow the new Tabor parameter is returned as its indentation history.
    """
    terms = np.arange(effects.of)
    simple = without_terms(scene, terms < effects.first, terms >= effects.last)
    adhesion = scene.adhesion if effects.adhesion else HardContact()
    simple = replace(simple, adhesion=adhesion, spring=scene.spring if effects.spring else None)
    if isinstance(protocol, LoadingProtocol) and simple.tabor != scene.tabor:
        return simple, protocol.history(scene.tabor)
    return simple, protocol
