"""The tables of `docs/units.md`: three real contacts in the solver's units, and the effect of the effective range."""

import re
import warnings

from bem import Elastic, StandardLinearSolid
from bem._support.wording import markdown_table
from bem.lab import EffectiveRangeWarning, Setup
from bem.lab.exporters import EXPORTERS
from bem.lab.units import readable
from bem.materials_library import load
from bem.methods.closed_forms.jkr import PULL_OFF_FORCE
from bem.problem.scene import LARGEST_TABOR

PDMS = load("sylgard_184_cured_at_100c")
CONTACTS = {
    "AFM tip on a polymer": Setup(radius=20e-9, work_of_adhesion=0.05, relaxed_modulus=1e9, poisson_ratio=0.35),
    "colloid probe on PDMS": Setup(radius=5e-6, work_of_adhesion=0.05, relaxed_modulus=PDMS.relaxed_modulus),
    "glass lens on PDMS": Setup(radius=5e-3, work_of_adhesion=0.05, relaxed_modulus=PDMS.relaxed_modulus),
}
RANGES = (1.0, 3.0, 10.0, 100.0, LARGEST_TABOR)
BEAD = {"radius": 50e-6, "work_of_adhesion": 0.05, "relaxed_modulus": 2e6}
RATIO, TIME, SPEED, DEPTH, DWELL = 0.3, 0.1, 2e-6, 1e-6, 0.5


def contacts_table() -> str:
    """Scales of the three contacts, one row each."""
    rows = {
        r"radius $R$": [readable(c.radius, "m") for c in CONTACTS.values()],
        "work of adhesion": [readable(c.work_of_adhesion, "J/m^2") for c in CONTACTS.values()],
        r"modulus $E_0$, Poisson's ratio": [
            f"{readable(c.relaxed_modulus, 'Pa')}, {c.poisson_ratio:g}" for c in CONTACTS.values()
        ],
        r"force scale $\pi R\Delta\gamma$": [readable(c.force_scale, "N") for c in CONTACTS.values()],
        r"contact radius scale $\beta$": [readable(c.contact_radius_scale, "m") for c in CONTACTS.values()],
        r"adhesion length $\mu h_0$": [readable(c.adhesion_length, "m") for c in CONTACTS.values()],
        r"Tabor parameter, $h_0 = 0.3$ nm": [f"{float(f'{c.physical_tabor:.3g}'):,g}" for c in CONTACTS.values()],
        "limit": [c.regime for c in CONTACTS.values()],
        r"stiffness scale $\pi R\Delta\gamma/h_0$": [readable(c.stiffness_scale, "N/m") for c in CONTACTS.values()],
        "JKR pull-off force": [readable(PULL_OFF_FORCE * c.force_scale, "N") for c in CONTACTS.values()],
    }
    return _symbols(markdown_table(["quantity", *CONTACTS], [[name, *cells] for name, cells in rows.items()]))


def ranges_table() -> str:
    """Pull-off forces over pi R dgamma of one bead at several effective ranges, elastic and viscoelastic."""
    rows = []
    for largest in RANGES:
        forces = []
        for material, time in ((Elastic(), None), (StandardLinearSolid(RATIO), TIME)):
            setup = Setup(**BEAD, material=material, retardation_time=time, largest_tabor=largest)
            protocol = setup.protocol(
                peak_indentation=DEPTH, loading_rate=SPEED, dwell_time=DWELL, unloading_rate=SPEED
            )
            with warnings.catch_warnings(action="ignore", category=EffectiveRangeWarning):
                curve = setup.simulate(protocol, "standard")
            forces.append(curve.pull_off_force / setup.force_scale)
        rows.append([f"{setup.tabor:.3g}", readable(setup.gap, "m"), *(f"{force:.2f}" for force in forces)])
    return _symbols(markdown_table(["Tabor parameter", "gap $h_0$", "elastic", "viscoelastic"], rows))


def exporters_table() -> str:
    """Columns of the text files of each exporter, with what they hold; one row each."""
    rows = []
    for exporter, columns in EXPORTERS.items():
        names: dict[str, list[str]] = {}
        for name, (quantity, unit) in columns.items():
            names.setdefault(f"{quantity} ({unit})" if unit else quantity, []).append(f"`{name}`")
        rows.append([exporter, "; ".join(f"{quantity}: {', '.join(titles)}" for quantity, titles in names.items())])
    return markdown_table(["exporter", "what its columns hold, in which unit unless the title has one"], rows)


def _symbols(table: str) -> str:
    """A table whose units have their symbols instead of ASCII."""
    return re.sub(r"(?<=\d )u(?=[mN])", "µ", table).replace("J/m^2", "J/m²")
