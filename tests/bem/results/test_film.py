import dataclasses

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

import bem
from bem import Elastic, HardContact, LennardJones, LoadingProtocol, Scene, StandardLinearSolid
from bem.lab import Setup
from bem.methods.boundary_elements.influence.triangles import influence_matrix
from bem.problem.tractions import traction
from bem.results.film import draw_filmstrip, require_film
from bem.results.profiles import moments

SCENE = Scene(1.0, StandardLinearSolid(0.1))
PROTOCOL = LoadingProtocol(peak_indentation=5.0, loading_rate=10.0, dwell_time=0.5, unloading_rate=10.0)


@pytest.fixture(scope="module")
def trajectory():
    return bem.simulate(SCENE, PROTOCOL, profiles=30)


def test_profiles_change_little_else(trajectory):
    without = bem.simulate(SCENE, PROTOCOL)
    assert without.profiles is None
    assert trajectory.pull_off_force == pytest.approx(without.pull_off_force, rel=1e-3)
    assert trajectory.hysteresis == pytest.approx(without.hysteresis, rel=1e-3)


def test_force_integrates_the_traction(trajectory):
    profiles = trajectory.profiles
    np.testing.assert_allclose(profiles.force, trajectory.at(profiles.time), rtol=1e-9)
    radius, stress = profiles.radius, profiles.tabor * profiles.traction
    inner, outer = radius[:, :-1], radius[:, 1:]
    rings = (outer - inner) * ((2 * inner + outer) * stress[:, :-1] + (inner + 2 * outer) * stress[:, 1:]) / 3.0
    # What is missing is the far field beyond the last node, and the curvature of the traction between nodes.
    np.testing.assert_allclose(np.nansum(rings, axis=1), profiles.force, atol=0.02)


def test_gap_and_traction_obey_the_law(trajectory):
    profiles = trajectory.profiles
    pulling = profiles.traction > 1e-3
    np.testing.assert_allclose(profiles.traction[pulling], traction(profiles.gap[pulling]), rtol=1e-9)
    last = -1 if np.isfinite(profiles.radius[0, -1]) else np.argmax(np.isnan(profiles.radius[0])) - 1
    assert abs(profiles.displacement[0, last]) < 0.2
    np.testing.assert_allclose(profiles.sphere + profiles.displacement, profiles.gap, rtol=1e-12)


def test_elastic_displacement_from_traction():
    protocol = LoadingProtocol(peak_indentation=2.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0)
    profiles = bem.simulate(Scene(1.0, Elastic()), protocol, profiles=[2.5]).profiles
    finite = np.isfinite(profiles.radius[0])
    radius, stress = profiles.radius[0, finite], profiles.traction[0, finite]
    displacement = -influence_matrix(radius) @ stress
    near = radius < 0.5 * radius[-1]
    np.testing.assert_allclose(displacement[near], profiles.displacement[0, finite][near], atol=0.02)


def test_moments_are_among_the_profiles(trajectory):
    named = moments(trajectory)
    assert list(named) == ["apart", "first contact", "pressed", "relaxed", "pull-off", "released"]
    # The pull-off time is that of the simulation before.
    assert all(np.abs(trajectory.profiles.time - time).min() < 1e-3 for time in named.values())
    held = trajectory.time[trajectory.indentation > PROTOCOL.peak_indentation - 1e-9]
    assert (named["pressed"], named["relaxed"]) == (held[0], held[-1])


def test_pressed_and_relaxed_moments():
    # An elastic contact that is pulled throughout is pulled least where the sphere is far away.
    quick = LoadingProtocol(peak_indentation=5.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1000.0)
    scene = Scene(3.2, Elastic())
    trajectory = bem.simulate(scene, quick, "draft", profiles=40)
    named = moments(trajectory)
    assert list(named) == ["apart", "first contact", "pressed", "pull-off", "released"]
    assert named["pressed"] == trajectory.time[trajectory.indentation.argmax()]
    # Each cycle presses again; only the deepest counts, and it has no dwell.
    times, depths = [0.0, 10.0, 11.0, 20.0, 31.0, 42.0], [-7.0, 2.0, 2.0, -7.0, 4.0, -7.0]
    cycles = bem.simulate(scene, bem.PiecewiseLinearProtocol(times, depths), "draft")
    assert moments(cycles)["pressed"] == 31.0
    assert "relaxed" not in moments(cycles)
    history = draw_filmstrip(trajectory).axes[0]
    line = history.lines[1].get_xydata()
    assert len(trajectory.jumps) == 2
    assert np.isnan(line[:, 1]).any()
    steps = np.abs(np.diff(line[:, 1]))
    assert np.nanmax(steps) < 0.1 < abs(trajectory.jumps[0].force_after - trajectory.jumps[0].force_before)


def test_profiles_become_tables(trajectory, tmp_path):
    table = trajectory.profiles.to_xarray()
    assert table["gap"].dims == ("profile", "node")
    assert table["displacement"].attrs["units"] == "h0"
    trajectory.profiles.to_hdf5(tmp_path / "profiles.h5")
    import h5py

    with h5py.File(tmp_path / "profiles.h5") as file:
        np.testing.assert_array_equal(file["traction"][:], trajectory.profiles.traction)
        assert file["radius"].attrs["units"] == "beta"


@pytest.mark.parametrize("adhesion", [LennardJones(), HardContact()])
def test_filmstrip_marks_force_history(trajectory, adhesion):
    if isinstance(adhesion, HardContact):
        trajectory = bem.simulate(Scene(1.0, StandardLinearSolid(0.1), adhesion), PROTOCOL, "draft", profiles=30)
    figure = draw_filmstrip(trajectory)
    panels = [axes for axes in figure.axes if axes.get_title()]
    assert [axes.get_title().split("  ")[1] for axes in panels] == list(moments(trajectory))
    for axes in panels:  # also where the whole sphere lies below the top
        assert axes.collections[0].get_paths()[0].vertices[:, 1].max() >= axes.get_ylim()[1]
    surface = np.concatenate(panels[list(moments(trajectory)).index("pressed")].collections[2].get_segments())[:, 1]
    assert surface[surface.size // 2] < surface[0] - 1.0  # in units of h0, below what is far away
    adheres = isinstance(adhesion, LennardJones)
    assert ("pull-off" in moments(trajectory)) == adheres
    assert [float(tick.get_text()) > 0.0 for tick in figure.axes[-1].get_yticklabels()][2:] == [True] * adheres


def test_film_has_a_frame_per_profile(tmp_path, monkeypatch):
    figures = []

    def layout(self, *engine, **more):
        figures.append(self)
        return original(self, *engine, **more)

    original = Figure.set_layout_engine
    monkeypatch.setattr(Figure, "set_layout_engine", layout)
    bem.simulate(SCENE, PROTOCOL, "draft", profiles=[0.1, 0.8]).animate(tmp_path / "contact.gif")
    with Image.open(tmp_path / "contact.gif") as film:
        assert film.n_frames == 2
    _, history, bar = figures[-1].axes
    force, traction = (axes.yaxis.label.get_window_extent() for axes in (history, bar))
    assert force.x0 - traction.x1 > 0.5 * force.width


def test_what_is_no_film_is_refused(trajectory, tmp_path, monkeypatch):
    with pytest.raises(ValueError, match="needs profiles: pass profiles=80"):
        dataclasses.replace(trajectory, profiles=None).animate(tmp_path / "contact.gif")
    with pytest.raises(ValueError, match=r"called .gif or .mp4; received"):
        trajectory.animate(tmp_path / "contact.avi")
    monkeypatch.setenv("PATH", "")
    with pytest.raises(ValueError, match="file needs ffmpeg"):
        require_film("contact.mp4")


def test_si_filmstrip_is_the_same_picture():
    setup = Setup(radius="50um", work_of_adhesion="50mJ/m2", relaxed_modulus="2MPa", largest_tabor=3.0)
    protocol = setup.protocol(peak_indentation="1um", loading_rate="2um/s", unloading_rate="2um/s")
    trajectory = bem.simulate(setup.scene(), protocol, "draft", profiles=12)
    own, si = draw_filmstrip(trajectory), draw_filmstrip(trajectory, setup)
    labels = {axes.get_xlabel() for axes in si.axes} | {axes.get_ylabel() for axes in si.axes}
    assert {"radius (µm)", "height (µm)", "force (µN), tension positive", "traction (kPa)"} <= labels
    scales = (
        (1e6 * setup.contact_radius_scale, 1e6 * setup.gap),
        (1.0, 1e6 * setup.force_scale),
    )
    panels = len(own.axes) - 2  # the force history comes first, the bar of colours last
    for number, factors in ((1, scales[0]), (panels, scales[0]), (0, scales[1])):
        drawn, expected = (figure.axes[number].lines[-1 if number else 1].get_xydata() for figure in (si, own))
        np.testing.assert_allclose(drawn, expected * factors, rtol=1e-9, atol=1e-12)
    assert next(text.get_text() for text in si.axes[0].get_xticklabels()) == "0 s"
