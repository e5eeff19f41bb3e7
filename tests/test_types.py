"""A type checker that reads a user's program refuses wrong calls of both packages, and only those."""

import os
import re

import pytest

from tests.processes import ROOT, python

PROGRAM = """
import warnings

import numpy as np

import bem.lab
import surrogate
from bem import Elastic, LoadingProtocol, PronySeries, Scene, StandardLinearSolid, Trajectory, simulate
from bem.lab import ForceCurve, Setup, fit

protocol = LoadingProtocol(peak_indentation=20, loading_rate=10.0, dwell_time=1, unloading_rate=10)
trajectory: Trajectory = simulate(Scene(tabor=1.0, material=Elastic()), protocol, 1e-3)
pull_off: float = trajectory.pull_off_force
broad = Scene(0.5, PronySeries([0.5, 0.2], times=[1.0, 10.0]))
bead = Setup(radius="50 um", work_of_adhesion=0.05, relaxed_modulus="2 MPa")
radius: float = bead.radius
path = bead.protocol(peak_indentation="1 um", loading_rate=1e-6, unloading_rate=1e-6)
curve: ForceCurve = bead.simulate(path, force_sign="compression")
sentences: tuple[str, ...] = fit(curve, bead).sentences
model = surrogate.load("M1-concat")
warnings.simplefilter("ignore", surrogate.ExtrapolationWarning)
scene = Scene(1.0, StandardLinearSolid(0.1))
forces: np.ndarray = model.predict_history(np.zeros((1, 3)), np.zeros((1, 3)), scene)
detached: bool = model.predict(scene, protocol).detached
all_detached: list[bool] = [one.detached for one in model.predict([scene], [protocol])]

simulate(1, 2)  # refused
simulate(broad, protocol, initial_state="cold")  # refused
trajectory.pull_of_force  # refused
bem.simulat  # refused
surrogate.lod  # refused
bem.lab.Fit  # refused
Scene(tabor="soft")  # refused
LoadingProtocol(peak_indentation=20)  # refused
Setup(radius=[50e-6], work_of_adhesion=0.05, relaxed_modulus=2e6)  # refused
bead.simulate(path, force_sign="upwards")  # refused
fit(trajectory, bead)  # refused
model.predict(scene, 3.0)  # refused
number: int = model.predict_history(np.zeros((1, 3)), np.zeros((1, 3)), scene)  # refused
"""


@pytest.mark.slow
def test_type_checker_refuses_wrong_calls(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM, encoding="utf-8")
    # As installed packages: their own errors are not the user's.
    options = ["--config-file=", "--follow-imports=silent", "--ignore-missing-imports", "--no-pretty"]
    arguments = ("-m", "mypy", *options, "--cache-dir", tmp_path / "cache", "program.py")
    result = python(*arguments, cwd=tmp_path, env=os.environ | {"MYPYPATH": str(ROOT)})
    refused = {int(line) for line in re.findall(r"^program\.py:(\d+): error: ", result.stdout, flags=re.MULTILINE)}
    lines = PROGRAM.splitlines()
    assert refused == {number for number, line in enumerate(lines, 1) if line.endswith("# refused")}, result.stdout
