"""Contacts in SI units: set up an experiment, simulate it, read a measured force curve and fit it.

Lengths in m, forces in N, moduli in Pa, works of adhesion in J/m^2, times in s. Text such as "50 um" and
quantities of Pint are understood too. `docs/units.md` has the conventions.

Examples:
    >>> from bem import StandardLinearSolid
    >>> from bem.lab import Setup
    >>> bead = Setup(radius=50e-6, work_of_adhesion=0.05, relaxed_modulus=2e6, retardation_time=0.01,
    ...              material=StandardLinearSolid(modulus_ratio=0.3))
    >>> print(f"{bead.force_scale:.3g} N")
    7.85e-06 N
"""

from typing import TYPE_CHECKING

from bem._support.lazy_names import lazy_names

if TYPE_CHECKING:
    from bem.lab.curve import ForceCurve as ForceCurve
    from bem.lab.fitting import FitResult as FitResult
    from bem.lab.fitting import fit as fit
    from bem.lab.setup import EffectiveRangeWarning as EffectiveRangeWarning
    from bem.lab.setup import Setup as Setup
else:  # the imports above are the list of the public names; each loads on first use
    __all__ = lazy_names(globals())
