from .curve import ForceCurve as ForceCurve
from .fitting import FitResult as FitResult
from .fitting import fit as fit
from .setup import EffectiveRangeWarning as EffectiveRangeWarning
from .setup import Setup as Setup
