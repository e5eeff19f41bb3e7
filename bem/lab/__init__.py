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

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)  # of the names in __init__.pyi
