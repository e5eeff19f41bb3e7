from .contact import Contact as Contact
from .dataset.cases import Cases as Cases
from .dataset.cases import load_cases as load_cases
from .dataset.run import run_campaign as run_campaign
from .methods.paper_method import simulate_paper_method as simulate_paper_method
from .problem.indenter import PowerLaw as PowerLaw
from .problem.materials import Elastic as Elastic
from .problem.materials import PronySeries as PronySeries
from .problem.materials import StandardLinearSolid as StandardLinearSolid
from .problem.protocol import ForceProtocol as ForceProtocol
from .problem.protocol import LoadingProtocol as LoadingProtocol
from .problem.protocol import PiecewiseLinearProtocol as PiecewiseLinearProtocol
from .problem.scene import Scene as Scene
from .problem.tractions import ConstantStress as ConstantStress
from .problem.tractions import Exponential as Exponential
from .problem.tractions import HardContact as HardContact
from .problem.tractions import LennardJones as LennardJones
from .problem.tractions import TractionLaw as TractionLaw
from .recommendation import recommend as recommend
from .results.trajectory import Trajectory as Trajectory
from .simulation import simulate as simulate

__version__: str
