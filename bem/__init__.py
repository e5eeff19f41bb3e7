"""Adhesive contact of a rigid sphere with a viscoelastic half-space.

Names load on first use, so that `import bem` is quick and a scene can be described without compiling a kernel.

Examples:
    >>> from bem import LoadingProtocol, Scene, StandardLinearSolid, simulate
    >>> scene = Scene(tabor=1.0, material=StandardLinearSolid(modulus_ratio=0.1))
    >>> protocol = LoadingProtocol(peak_indentation=5.0, loading_rate=10.0, dwell_time=0.1, unloading_rate=10.0)
    >>> trajectory = simulate(scene, protocol)  # doctest: +SKIP
"""

import lazy_loader

__version__ = "0.2.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)  # of the names in __init__.pyi
