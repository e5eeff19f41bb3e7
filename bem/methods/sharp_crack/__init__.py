"""Soft viscoelastic contacts, whose edge is a crack with a process zone much smaller than the contact.

`march_crack` follows a history; `zone` and `tail` hold the physics of the edge, `far_field` that of the contact.
"""

from bem.methods.sharp_crack.trajectory import STEP_ERROR as STEP_ERROR
from bem.methods.sharp_crack.trajectory import ZONE_ERROR as ZONE_ERROR
from bem.methods.sharp_crack.trajectory import SharpCrack as SharpCrack
from bem.methods.sharp_crack.trajectory import expected_error as expected_error
from bem.methods.sharp_crack.trajectory import is_sharp as is_sharp
from bem.methods.sharp_crack.trajectory import least_error as least_error
from bem.methods.sharp_crack.trajectory import load_steps as load_steps
from bem.methods.sharp_crack.trajectory import march_crack as march_crack
from bem.methods.sharp_crack.zone import ZoneError as ZoneError
