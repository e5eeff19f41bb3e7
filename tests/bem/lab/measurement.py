"""Measured curves that are made up, by the solver or by closed forms, and a file of several of them."""

import numpy as np

from bem import StandardLinearSolid, simulate
from bem.lab import ForceCurve, Setup
from experiments.robustness.lab_curves import CLASSES

TRUTH = {
    "relaxed_modulus": 2e6,
    "work_of_adhesion": 0.05,
    "retardation_time": 0.1,
    "modulus_ratio": 0.3,
    "contact_point": 0.13e-6,
    "force_offset": 2e-6,
}
BEAD = Setup(
    radius=50e-6,
    work_of_adhesion=0.05,
    relaxed_modulus=2e6,
    retardation_time=0.1,
    material=StandardLinearSolid(modulus_ratio=0.3),
)
CYCLE = {"peak_indentation": 1e-6, "loading_rate": 2e-6, "dwell_time": 0.5, "unloading_rate": 2e-6}


def measured(setup=BEAD, noise=0.01, points=300, truth=TRUTH, accuracy="standard", **changes):
    """A curve of 1 % noise of its range; behind a spring the indentation is that of stage and measured force."""
    protocol = setup.protocol(**(CYCLE | {"start_indentation": -1.5e-6} | changes))
    trajectory = simulate(setup.scene(), protocol, accuracy)
    time = np.linspace(0.0, trajectory.time[-1], points)
    force = trajectory.at(time) * setup.force_scale
    place = protocol.history(setup.tabor).indentation_at(time) * setup.indentation_scale + truth["contact_point"]
    force = force + truth["force_offset"] + noise * np.ptp(force) * np.random.default_rng(0).standard_normal(points)
    behind = {} if setup.stiffness is None else {"stage": place}
    depth = place if setup.stiffness is None else place + force / setup.stiffness
    return ForceCurve(time=time * setup.time_scale, indentation=depth, force=force, **behind)


def closed_form(name, seed, noise=0.01, **changes):
    """Curve, known setup and truth of a class of closed forms."""
    return CLASSES[name](np.random.default_rng(seed), noise=noise, **changes)


def loop(half):
    """Depths from -1 to 1 and back, `half` of them each way."""
    return np.concatenate([np.linspace(-1.0, 1.0, half), np.linspace(1.0, -1.0, half)])


def over_time(depth, force, duration=1.0):
    """A curve whose points are evenly spaced in time."""
    return ForceCurve(time=np.linspace(0.0, duration, depth.size), indentation=depth, force=force)


def write_map(path, curves):
    """Write curves as an instrument's file of several, HDF5 of afmformats, a micrometre apart."""
    import afmformats
    import h5py

    with h5py.File(path, "w") as file:
        for number, curve in enumerate(curves):
            data = {
                "time": curve.time,
                "force": -curve.tension,
                "height (measured)": -(curve.indentation if curve.stage is None else curve.stage),
                "segment": (np.arange(len(curve)) > np.argmax(curve.indentation)).astype(np.uint8),
            }
            facts = {"spring constant": curve.stiffness or 1e6, "imaging mode": "force-distance", "path": path}
            facts |= {"enum": number, "position x": 1e-6 * (number % 16), "position y": 1e-6 * (number // 16)}
            afmformats.AFMForceDistance(data, facts).export_data(file, fmt="hdf5")
