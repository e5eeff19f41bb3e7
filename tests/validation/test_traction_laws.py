"""Traction laws other than Lennard-Jones: Maugis's closed form, the limits of JKR and DMT, and energy.

Maugis's law has two jumps; the solver's rises within 0.02 and falls within `width`. The deviations below are those of
this smoothing and of the standard accuracy together. Source: Maugis, J. Colloid Interface Sci. 150 (1992) 243.
"""

import numpy as np
import pytest

from bem import ConstantStress, Elastic, Exponential, LoadingProtocol, Scene, StandardLinearSolid, simulate
from bem.reference_solutions import maugis_dugdale

CYCLE = LoadingProtocol(peak_indentation=2.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0)


def run(tabor, law, material=None, accuracy="standard", protocol=CYCLE):
    trajectory = simulate(Scene(tabor, material or Elastic(), law), protocol, accuracy)
    assert trajectory.completed, trajectory.status
    return trajectory
