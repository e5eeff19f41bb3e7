from .architectures import build as build
from .architectures.naming import names as names
from .architectures.registry import register as register
from .loading import load as load
from .model import Surrogate as Surrogate
from .training.interface import train as train
from .validity import ExtrapolationWarning as ExtrapolationWarning
