"""What the words of a user refuse: one sentence with the quantity, what is allowed and what was received."""

from functools import partial

import numpy as np
import pytest

from bem import (
    ConstantStress,
    Contact,
    HardContact,
    PowerLaw,
    Scene,
    TractionLaw,
    recommend,
    simulate,
    simulate_paper_method,
)
from bem.dataset.campaign import Campaign
from bem.dataset.designs import Design
from bem.dataset.measurement_steps import measurement_grid, proportional_counts
from bem.dataset.pull_off_steps import pull_off_grid
from bem.materials_library import fit_prony
from bem.methods.boundary_elements.influence.triangles import require_mesh
from bem.methods.boundary_elements.meshes.mesh import uniform_mesh
from bem.methods.closed_forms import persson_brener
from bem.problem.accuracy import resolve_accuracy
from bem.problem.materials import Elastic, PronySeries, StandardLinearSolid
from bem.problem.protocol import ForceProtocol, LoadingProtocol, PiecewiseLinearProtocol

CYCLE = {"peak_indentation": 10.0, "loading_rate": 2.0, "dwell_time": 0.5, "unloading_rate": 4.0}
SCENE, PROTOCOL = Scene(1.0, StandardLinearSolid(0.1)), LoadingProtocol(**CYCLE)
PAIRS = [0.0, 1.0], [0.0, 1.0]
NUMBER = "must be a finite number"
RATIO = f"modulus_ratio {NUMBER} greater than 0 and at most 1; received"
SPEED = rf"{NUMBER} at least 1e-12 and at most 1e\+12; received"
INSIDE = "mesh must reach beyond the contact, .*; received one that ends at 2"
DISC = "uniform_mesh needs a radius > 0 and a count of at least 3"

scene, cycle = partial(Scene, tabor=1.0), partial(LoadingProtocol, **CYCLE)
simulated = partial(simulate, scene=SCENE, protocol=PROTOCOL, accuracy="draft")
by_the_paper = partial(simulate_paper_method, scene=SCENE, protocol=PROTOCOL)
recommended = partial(recommend, scene=SCENE, protocol=PROTOCOL, tolerance=0.1)
begun, labelled = partial(Contact, scene=SCENE), partial(PiecewiseLinearProtocol, *PAIRS)
uniform_steps = partial(measurement_grid, **CYCLE, tabor=1.0)
SOLID = {"strengths": [[0.9]], "retardation_times": [[1.0]], "pull_off_time": 8.0}
pull_off_steps = partial(pull_off_grid, **CYCLE, tabor=1.0, **SOLID)
drawn = partial(Design("paper").protocols, count=1, seed=0)
disc = partial(uniform_mesh, radius=1.0, count=10)
fitted = partial(fit_prony, frequency=[1.0, 10.0, 100.0], storage=[1.0, 1.5, 2.0], loss=[0.1, 0.2, 0.1])
energy = partial(persson_brener.effective_energy, crack_velocity=1.0, modulus_ratio=0.1)
velocity = partial(persson_brener.crack_velocity, effective_energy=1.0, modulus_ratio=0.1)
CONE = scene(indenter=PowerLaw(1.0))


def advanced(duration=1.0, **step):
    return Contact(SCENE).advance(duration, **step)


def started(**changes):
    return cycle(**changes).history(1.0)


def each(call, name, message, *values):
    return [(call, {name: value}, message) for value in values]


REFUSED = [
    *each(scene, "tabor", f"tabor {NUMBER} at least 1e-06 and at most 1e\\+07", 0, np.nan, np.inf, 1e8, "3"),
    *each(scene, "material", r"material must be one of Elastic\(\.\.\.\), ", "rubber", None, Elastic, HardContact()),
    *each(scene, "adhesion", "adhesion must be one of LennardJones", Elastic(), "none", ConstantStress, TractionLaw),
    *each(scene, "spring", r"spring must be .* at least 1e-12 and at most 1e\+12", 0.0, np.nan, -np.inf, 1e13, True),
    *each(StandardLinearSolid, "modulus_ratio", RATIO, 0, 1.1, "soft"),
    *each(ConstantStress, "width", rf"width {NUMBER} at least 0\.05 and at most 1", 0.01, 2.0, "wide", True),
    *each(cycle, "loading_rate", f"loading_rate {SPEED}", 0.0, -1.0, np.nan, np.inf, 1e13, "fast"),
    *each(cycle, "unloading_rate", f"unloading_rate {SPEED}", 0.0, 1e13),
    *each(cycle, "dwell_time", "dwell_time must be a finite number at least 0", -1e-9),
    *each(cycle, "peak_indentation", "peak_indentation must be a finite number", np.nan),
    *each(cycle, "start_indentation", r"start_indentation must be .* less than 10; received 10\.0", 10.0),
    *each(simulated, "scene", r"^scene must be one of Scene\(\.\.\.\); received 'a sphere'$", "a sphere"),
    *each(simulated, "protocol", r"^protocol must be one of LoadingProtocol\(\.\.\.\), Piece.*; received 3\.0$", 3.0),
    *each(simulated, "accuracy", r"^accuracy must be 'draft', .*; received 'perfect'$", "perfect"),
    *each(simulated, "initial_state", r"^initial_state must be 'relaxed' or 'glassy'; received 'wet'$", "wet"),
    *each(simulated, "mesh", r"^mesh must start at 0 and increase strictly; received", [0.0, 2.0, 1.0]),
    *each(simulated, "mesh", r"^mesh must be a 1D array of at least 3 finite radii", [0.0, 2.0]),
    *each(simulated, "mesh", INSIDE, uniform_mesh(2.0, 200)),
    (simulated, {"mesh": uniform_mesh(2.0, 200), "scene": scene(adhesion=HardContact())}, INSIDE),
    *each(PowerLaw, "exponent", f"exponent of the indenter {NUMBER} at least 1 and", 0.5, 9.0, np.nan, "cone"),
    *each(scene, "indenter", r"indenter must be one of PowerLaw\(...\)", "cone"),
    *each(by_the_paper, "scene", "the paper's method knows the paraboloid only", CONE),
    *each(recommended, "scene", "recommend knows the paraboloid only", CONE),
    *each(by_the_paper, "nodes", "nodes must be a whole number from 10 to 4000", 5),
    *each(by_the_paper, "steps", "steps must be a whole number from 2 to 20000", 1),
    *each(by_the_paper, "scene", "adhesion of the scene must be one of LennardJones", scene(adhesion=HardContact())),
    *each(by_the_paper, "scene", "the paper's method knows no spring", scene(spring=1.0)),
    *each(by_the_paper, "protocol", "protocol must be one of", None),
    *each(simulated, "profiles", r"profiles must be .* 2 .*10000; received 1", 1),
    *each(
        simulated, "profiles", "profiles must be 1 to 10000 increasing instants, or their number; received", [0.5, 0.5]
    ),
    *each(
        simulated,
        "profiles",
        "profiles must lie within the protocol, from 0 to .*; received instants from 0.5 to 99",
        [0.5, 99.0],
    ),
    *each(simulated, "profiles", "profiles", "all"),
    (advanced, {}, "either an indentation or a force; received indentation=None, force=None"),
    (advanced, {"indentation": 1.0, "force": 1.0}, "either an indentation or a force; received indentation=1.0"),
    *each(advanced, "indentation", "indentation must be a finite number", np.nan),
    *each(advanced, "force", "force must be a finite number", 1e12),
    (advanced, {"duration": 0.0, "force": 0.0}, "duration must be a finite number greater than 0; received 0"),
    *each(begun, "initial_state", "initial_state must be 'relaxed' or 'glassy'; received 'soft'", "soft"),
    *each(begun, "scene", "scene must be", "a scene"),
    *each(recommended, "tolerance", "tolerance must be a finite number at least 0.001", 0.0),
    *each(
        recommended, "quantity", "quantity must be one of force, pull_off_force, hysteresis; received 'speed'", "speed"
    ),
    *each(recommended, "best", "best must be one of cheapest, fewest; received 'quickest'", "quickest"),
    *each(recommended, "scene", "scene must be one of", 1.0),
    *each(recommended, "protocol", "protocol must be one of", 1.0),
    *each(recommended, "protocol", r"must be one of LoadingProtocol\(\.\.\.\), Piecewise", ForceProtocol(*PAIRS)),
    *each(disc, "radius", f"{DISC}; received", 0.0, -1.0, np.nan, np.inf),
    *each(disc, "count", f"{DISC}; received", 2),
    *each(require_mesh, "radii", "^mesh must .*; received", [0.0, 1.0], [0.1, 1.0, 2.0], [0.0, 1.0, 1.0]),
    *each(require_mesh, "radii", "^mesh must .*; received", [0.0, np.nan, 2.0], [[0.0, 1.0, 2.0]], [0.0, 2.0, 1.0]),
    *each(fitted, "frequency", "frequency must be strictly increasing", [1.0, 0.5, 2.0]),
    *each(fitted, "storage", "storage must be greater than 0; received -1.0", [1.0, -1.0, 2.0]),
    *each(fitted, "loss", "loss must have as many values as frequency; received 4 and 3", [1.0] * 4),
    *each(fitted, "terms", "terms must be a whole number from 1 to 100; received 0", 0),
    (fitted, {"storage": [1e-9, 1e-7, 1e-5], "loss": [1.0, 10.0, 100.0]}, "the moduli are those of a fluid"),
    (PronySeries, {"compliances": [0.5, 0.5], "times": [1.0, 2.0]}, "sum less than 1"),
    *each(labelled, "phases", "phases must name each of the 1 segments", ("loading", "dwell")),
    *each(started, "dwell_time", "the dwell phase must outlast the rounding of its start time", 1e-300),
    (energy, {"crack_velocity": -1.0}, "crack_velocity must be finite and at least 0; received -1"),
    (energy, {"modulus_ratio": 0.0}, "modulus_ratio must be greater than 0 and at most 1; received 0"),
    (velocity, {"effective_energy": 11.0}, "effective_energy must lie between 1 and 1/modulus_ratio"),
    (velocity, {"modulus_ratio": 1.0}, "modulus_ratio must be greater than 0 and less than 1"),
    *each(
        resolve_accuracy,
        "accuracy",
        r"^accuracy must be 'draft', 'standard', 'reference' or .*; received",
        *("best", "", "1e-3", None, True, 0.0, -1e-3, np.nan, np.inf, 0.06, 1e-5, [1e-3], 1e-3 + 0j),
    ),
]
"""What describes a contact or is asked of one."""
OF_DATA_SETS = [
    *each(Campaign, "count", "count must be a whole number from 1 to 559872; received '12'", "12"),
    *each(Campaign, "seed", "seed must be a whole number", -1),
    *each(Campaign, "counts", "counts must be three integers", (50.9, 20, 50), 120),
    (Campaign, {"shard": (4, 5), "count": 3}, "shards must be a whole number from 1 to 3; received 5"),
    *each(Campaign, "steps", "steps must be one of uniform, pull-off; received 'even'", "even"),
    *each(Campaign, "shard", "shard must be a whole number from 1 to 5; received 0", (0, 5)),
    *each(Design, "name", "design must be one of paper, log-uniform, sobol, edges, corners; received 'latin'", "latin"),
    *each(Design, "ranges", "range of tabor must have its lower bound first", {"tabor": (3.0, 1.0)}),
    *each(Design, "ranges", "lower bound of tabor must be a finite number at least 1e-06", {"tabor": (0.0, 1.0)}),
    *each(Design, "ranges", "upper bound of tabor must be a finite number", {"tabor": (1.0, np.nan)}),
    *each(Design, "ranges", "dwell_time must be a finite number at least 1e-12", {"dwell_time": (1e-13, 1.0)}),
    *each(Design, "ranges", "range of tabor must be two numbers", {"tabor": 1.0}),
    *each(Design, "ranges", "received 'radius'", {"radius": (1.0, 2.0)}),
    *each(Design, "modulus_ratio", RATIO, 0.0),
    *each(Design, "modulus_ratio", f"upper bound of {RATIO}", (0.1, 2.0)),
    (Design, {"modulus_ratio": (0.5, 0.1), "name": "sobol"}, "range of modulus_ratio must have its lower bound first"),
    *each(Design, "modulus_ratio", "range of modulus_ratio must be two numbers, low and high", (0.1, 0.5, 1.0)),
    *each(
        Design,
        "modulus_ratio",
        "a range of modulus_ratio needs the design log-uniform or sobol or edges or corners",
        (0.1, 0.5),
    ),
    *each(drawn, "count", "must be a whole number from", 0, True, 1.5, np.nan, 10**30, 559_873),
    *each(drawn, "seed", "must be a whole number from", -1, 0.5),
    *each(proportional_counts, "total", "total must be a whole number from 6 to", 5, -1, 120.0, True),
    *each(uniform_steps, "counts", "counts must be three integers", (1, 1, 1)),
    *each(uniform_steps, "dwell_time", "counts must ask for no dwell points where dwell_time is 0", 0.0),
    (
        uniform_steps,
        {"peak_indentation": 1e3, "loading_rate": 1e-12},
        "increasing in double precision; received protocol 0",
    ),
    (
        uniform_steps,
        {"tabor": 0.2, "peak_indentation": [1.0, -1.0]},
        r"received protocol 1 with -1\.0 and a start of -0\.4",
    ),
    *each(pull_off_steps, "loading_rate", "in double precision; received protocol 1", [1.0, 1e-300, 1.0]),
    *each(pull_off_steps, "counts", "at least 16 unloading points; received 15", (22, 8, 15)),
    *each(pull_off_steps, "dwell_time", "no dwell points", 0.0),
    (pull_off_steps, {"unloading_rate": 1e20, "loading_rate": 1e-10}, "strictly increasing"),
]


OF_PAIRS = [
    (make, {"times": times, name: values}, message)
    for make, name in ((PiecewiseLinearProtocol, "indentations"), (ForceProtocol, "forces"))
    for times, values, message in (
        ([0.0, 0.0], [0.0, 1.0], "times must be strictly increasing"),
        ([0.0, 1.0, 0.5], [0.0, 1.0, 2.0], r"received 1\.0 followed by 0\.5"),
        ([0.0], [0.0], "times must be a one-dimensional sequence of at least 2"),
        ([-np.inf, 0.0], [0.0, 1.0], "times must be"),
        ([0.0, 1.0], [0.0, np.nan], f"{name} must be a one-dimensional sequence"),
        ([0.0, 1.0], ["0", "1"], f"{name} must be"),
        ([0.0, 1.0], [0.0, 1.0, 2.0], f"times and {name} must have the same length; received 2 and 3"),
        (np.arange(100_001), np.zeros(100_001), "times must be at most 100000 instants, .*; received 100001"),
        ([0.0, 1.0], [0.0, 1e10], rf"{name} must lie within \+-1e\+0"),
    )
] + [
    (make, {name: amounts, "times": times}, message)
    for make, name in ((PronySeries, "compliances"), (PronySeries.from_moduli, "moduli"))
    for amounts, times, message in (
        ([-0.1], [1.0], f"{name} must be at least 0"),
        ([0.1], [0.0], "times must be greater than 0"),
        ([0.1], [np.inf], "times must be a one-dimensional"),
        ([0.1, 0.1], [1.0, 1.0], "distinct"),
        ([0.1, 0.1], [1.0], "same length"),
    )
]
"""Histories and spectra."""


@pytest.mark.parametrize(("call", "changes", "message"), REFUSED + OF_DATA_SETS + OF_PAIRS)
def test_a_wrong_quantity_is_named(call, changes, message):
    with pytest.raises(ValueError, match=message) as error:
        call(**changes)
    assert "received" in str(error.value)
    assert "\n" not in str(error.value)


def test_cycle_quantities_are_named():
    with pytest.raises(TypeError):
        LoadingProtocol(10.0, 2.0, 0.5, 4.0)
