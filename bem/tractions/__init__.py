"""What the two surfaces do to each other across the gap: the one place where a traction law is defined.

Units: gap in h0 (the actual gap, 1 at equilibrium), traction in dgamma/h0, positive in tension; forces in
pi R dgamma. All laws have unit work of adhesion and the largest traction of the Lennard-Jones law, 16 / (9 sqrt 3), as
in Maugis's comparison, so that the Tabor parameter means the same for each: Maugis's lambda is 1.157 mu.

`bem.tractions.laws` has the laws, `lennard_jones` the formulas of the default one, `law` what the kernels call. The
formulas of Lennard-Jones are `traction`, `slope`, `potential`, `tail_force` and `tail_energy`; those of any law are
`traction_at`, `slope_at`, and so on. `interface` has the law together with the Tabor parameter, on a mesh.
"""

from bem.tractions.interface import (
    Interface,
    deviation,
    force_of,
    interface_of,
    reshape,
    stored_energy,
    tail_bend,
    tail_share,
    tractions_of,
)
from bem.tractions.law import (
    LENNARD_JONES,
    Law,
    potential_at,
    slope_at,
    tail_energy_at,
    tail_force_at,
    traction_at,
)
from bem.tractions.laws import LAWS, ConstantStress, Exponential, HardContact, LennardJones, TractionLaw, law_of
from bem.tractions.lennard_jones import (
    GAP_AT_PEAK,
    PEAK_TRACTION,
    potential,
    slope,
    tail_energy,
    tail_force,
    traction,
)

__all__ = [
    "GAP_AT_PEAK",
    "LAWS",
    "LENNARD_JONES",
    "PEAK_TRACTION",
    "ConstantStress",
    "Exponential",
    "HardContact",
    "Interface",
    "Law",
    "LennardJones",
    "TractionLaw",
    "deviation",
    "force_of",
    "interface_of",
    "law_of",
    "potential",
    "potential_at",
    "reshape",
    "slope",
    "slope_at",
    "stored_energy",
    "tail_bend",
    "tail_energy",
    "tail_energy_at",
    "tail_force",
    "tail_force_at",
    "tail_share",
    "traction",
    "traction_at",
    "tractions_of",
]
