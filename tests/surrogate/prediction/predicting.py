"""What the tests of `surrogate predict` share: protocols, measured histories of them, and how a mistake must end."""

import re

import numpy as np

from bem import LoadingProtocol, Scene, StandardLinearSolid

PROTOCOL = {"peak_indentation": 20.0, "loading_rate": 10.0, "dwell_time": 1.0, "unloading_rate": 10.0}
FLAGS = [word for key, value in PROTOCOL.items() for word in (f"--{key.replace('_', '-')}", str(value))]


SCENE = Scene(1.0, StandardLinearSolid(0.1))


def refused(command, words, *, folder):
    """The one sentence a mistake ends in; nothing may be left behind."""
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    code, out, err = command(*words)
    assert (code, out) == (2, ""), err
    # One sentence, and not one within another.
    assert re.match(r"surrogate: (Expected|\w+ must|the \w+ phase must) ", err)
    assert len(re.findall(r"\b[Rr]eceived\b", err)) == 1
    assert err.count("\n") == 1
    assert len(err) < 1000
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    return err


FAST_WITHDRAWAL = LoadingProtocol(peak_indentation=20.0, loading_rate=10.0, dwell_time=1.0, unloading_rate=100.0)


def unresolved():
    """Points at equal times, two of them in the unloading."""
    times = np.linspace(0.0, FAST_WITHDRAWAL.phase_times(1.0)[-1], 25)
    noise = 0.02 * np.random.default_rng(0).normal(size=times.shape)
    return times, FAST_WITHDRAWAL.history(1.0).indentation_at(times) + noise


def history(protocol=FAST_WITHDRAWAL, tabor=1.0, points=(160, 80, 160), noise=0.0, seed=0):
    """Points of each phase, and the standard deviation of their noise as a share of the peak."""
    corners = protocol.phase_times(tabor)
    phases = [
        np.linspace(begin, end, count, endpoint=False)
        for begin, end, count in zip(corners[:-1], corners[1:], points, strict=True)
        if end > begin
    ]
    times = np.append(np.concatenate(phases), corners[-1])
    noisy = noise * protocol.peak_indentation * np.random.default_rng(seed).normal(size=times.shape)
    return times, protocol.history(tabor).indentation_at(times) + noisy
