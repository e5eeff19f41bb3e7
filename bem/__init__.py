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

if TYPE_CHECKING:
    from bem.dataset.campaign.cases import Cases, load_cases
    from bem.dataset.campaign.run import run_campaign
    from bem.effects.recommendation import recommend
    from bem.materials import Elastic, PronySeries, StandardLinearSolid
    from bem.protocol import ForceProtocol, LoadingProtocol, PiecewiseLinearProtocol
    from bem.scene import Scene
    from bem.solver.paper_method import simulate_paper_method
    from bem.solver.simulation import simulate
    from bem.tractions import ConstantStress, Exponential, HardContact, LennardJones, TractionLaw
    from bem.trajectory import Trajectory

__version__ = "0.1.0"

__all__ = [
    "Cases",
    "ConstantStress",
    "Elastic",
    "Exponential",
    "ForceProtocol",
    "HardContact",
    "LennardJones",
    "LoadingProtocol",
    "PiecewiseLinearProtocol",
    "PronySeries",
    "Scene",
    "StandardLinearSolid",
    "TractionLaw",
    "Trajectory",
    "load_cases",
    "recommend",
    "run_campaign",
    "simulate",
    "simulate_paper_method",
]

_HOME = {
    "Cases": "dataset.campaign.cases",
    "ConstantStress": "tractions",
    "Elastic": "materials",
    "Exponential": "tractions",
    "ForceProtocol": "protocol",
    "HardContact": "tractions",
    "LennardJones": "tractions",
    "LoadingProtocol": "protocol",
    "PiecewiseLinearProtocol": "protocol",
    "PronySeries": "materials",
    "Scene": "scene",
    "StandardLinearSolid": "materials",
    "TractionLaw": "tractions",
    "Trajectory": "trajectory",
    "load_cases": "dataset.campaign.cases",
    "recommend": "effects.recommendation",
    "run_campaign": "dataset.campaign.run",
    "simulate": "solver.simulation",
    "simulate_paper_method": "solver.paper_method",
}


# A type checker reads the imports above instead, and then refuses a name that is none.
if not TYPE_CHECKING:
    __getattr__, __dir__ = lazy_names(__name__, _HOME, globals())
