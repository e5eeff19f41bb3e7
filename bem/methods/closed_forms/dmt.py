"""Derjaguin, Muller and Toporov, and Bradley: the limits of long-range adhesion, mu -> 0.

DMT adds a constant attraction 2 to the Hertz force. Bradley's spheres are rigid, so that the force is that of the
undeformed gap, for the Lennard-Jones law largest (2) when the gap at the centre is 1. Units: see
`bem.methods.closed_forms`. Source: Derjaguin, Muller and Toporov, J. Colloid Interface Sci. 53 (1975) 314; Maugis,
Contact, Adhesion and Rupture of Elastic Solids (2000), chapter 4; Bradley, Phil. Mag. 13 (1932) 853.
"""

import numpy as np
from numpy.typing import ArrayLike

from bem._support.validation import FloatArray
from bem.methods.closed_forms import hertz

PULL_OFF_FORCE = 2.0


def force_from_indentation(indentation: ArrayLike, tabor: ArrayLike) -> FloatArray:
    """DMT force at an indentation >= 0; NaN where there is no contact. Shapes broadcast."""
    force = PULL_OFF_FORCE + hertz.force_from_indentation(indentation, tabor)
    return np.where(np.asarray(indentation) >= 0.0, force, np.nan)


def rigid_force_from_indentation(indentation: ArrayLike) -> FloatArray:
    """Bradley's force between rigid surfaces with the Lennard-Jones law at an indentation < 1, central gap 1 - it."""
    gap = 1.0 - np.asarray(indentation, dtype=np.float64)
    return np.where(gap > 0.0, 8.0 / 3.0 * (gap**-2.0 - 0.25 * gap**-8.0), np.nan)
