"""What the two surfaces do to each other across the gap: the one place where a traction law is defined.

Units: gap in h0 (the actual gap, 1 at equilibrium), traction in dgamma/h0, positive in tension; forces in
pi R dgamma. All laws have unit work of adhesion and the largest traction of the Lennard-Jones law, 16 / (9 sqrt 3), as
in Maugis's comparison, so that the Tabor parameter means the same for each: Maugis's lambda is 1.157 mu.

`bem.problem.tractions.laws` has the laws, `lennard_jones` the formulas of the default one, `law` what the kernels call.
The formulas of Lennard-Jones are `traction`, `slope`, `potential`, `tail_force` and `tail_energy`; those of any law are
`traction_at`, `slope_at`, and so on. `interface` has the law together with the Tabor parameter, on a mesh.
"""

from bem.problem.tractions.interface import Interface as Interface
from bem.problem.tractions.interface import deviation as deviation
from bem.problem.tractions.interface import force_of as force_of
from bem.problem.tractions.interface import interface_of as interface_of
from bem.problem.tractions.interface import stored_energy as stored_energy
from bem.problem.tractions.interface import tail_bend as tail_bend
from bem.problem.tractions.interface import tail_share as tail_share
from bem.problem.tractions.interface import tractions_of as tractions_of
from bem.problem.tractions.law import LENNARD_JONES as LENNARD_JONES
from bem.problem.tractions.law import Law as Law
from bem.problem.tractions.law import slope_at as slope_at
from bem.problem.tractions.law import tail_force_at as tail_force_at
from bem.problem.tractions.law import traction_at as traction_at
from bem.problem.tractions.laws import LAWS as LAWS
from bem.problem.tractions.laws import ConstantStress as ConstantStress
from bem.problem.tractions.laws import Exponential as Exponential
from bem.problem.tractions.laws import HardContact as HardContact
from bem.problem.tractions.laws import LennardJones as LennardJones
from bem.problem.tractions.laws import TractionLaw as TractionLaw
from bem.problem.tractions.laws import law_of as law_of
from bem.problem.tractions.lennard_jones import GAP_AT_PEAK as GAP_AT_PEAK
from bem.problem.tractions.lennard_jones import PEAK_TRACTION as PEAK_TRACTION
from bem.problem.tractions.lennard_jones import slope as slope
from bem.problem.tractions.lennard_jones import tail_force as tail_force
from bem.problem.tractions.lennard_jones import traction as traction
