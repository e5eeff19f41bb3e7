"""Adhesive contact of a rigid sphere with a viscoelastic half-space.

Names load on first use, so that `import bem` is quick and a scene can be described without compiling a kernel.

Examples:
    >>> from bem import LoadingProtocol, Scene, StandardLinearSolid, simulate
    >>> scene = Scene(tabor=1.0, material=StandardLinearSolid(modulus_ratio=0.1))
    >>> protocol = LoadingProtocol(peak_indentation=5.0, loading_rate=10.0, dwell_time=0.1, unloading_rate=10.0)
    >>> trajectory = simulate(scene, protocol)  # doctest: +SKIP
"""

from typing import TYPE_CHECKING

from bem._support.lazy_names import lazy_names

__version__ = "0.2.0"

if TYPE_CHECKING:
    from bem.contact import Contact as Contact
    from bem.dataset.cases import Cases as Cases
    from bem.dataset.cases import load_cases as load_cases
    from bem.dataset.run import run_campaign as run_campaign
    from bem.methods.paper_method import simulate_paper_method as simulate_paper_method
    from bem.problem.indenter import PowerLaw as PowerLaw
    from bem.problem.materials import Elastic as Elastic
    from bem.problem.materials import PronySeries as PronySeries
    from bem.problem.materials import StandardLinearSolid as StandardLinearSolid
    from bem.problem.protocol import ForceProtocol as ForceProtocol
    from bem.problem.protocol import LoadingProtocol as LoadingProtocol
    from bem.problem.protocol import PiecewiseLinearProtocol as PiecewiseLinearProtocol
    from bem.problem.scene import Scene as Scene
    from bem.problem.tractions import ConstantStress as ConstantStress
    from bem.problem.tractions import Exponential as Exponential
    from bem.problem.tractions import HardContact as HardContact
    from bem.problem.tractions import LennardJones as LennardJones
    from bem.problem.tractions import TractionLaw as TractionLaw
    from bem.recommendation import recommend as recommend
    from bem.results.trajectory import Trajectory as Trajectory
    from bem.simulation import simulate as simulate
else:  # the imports above are the list of the public names; each loads on first use
    __all__ = lazy_names(globals())
