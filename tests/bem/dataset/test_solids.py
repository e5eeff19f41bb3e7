"""Random linear solids: their prior, their spectra, the steps around their pull-off, and their data set."""

import numpy as np
import pytest
from scipy.integrate import quad

from bem import Elastic, PronySeries, Scene, StandardLinearSolid
from bem.cli.arguments import parse_solids
from bem.dataset.campaign import Campaign
from bem.dataset.designs import Design
from bem.dataset.file import load_dataset
from bem.dataset.lee_radok import held_to_unloading, relaxation_spectra, to_crossing
from bem.dataset.measurement_steps import PULL_OFF, measurement_grid
from bem.dataset.pull_off_steps import pull_off_grid
from bem.dataset.solids import LEAST_SHARE, Solids, solid_of
from bem.dataset.verification import verify
from bem.problem.materials import relaxation_spectrum
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import command, run_here

PROTOCOLS = {
    "tabor": np.array([1.0, 0.2, 3.0]),
    "peak_indentation": np.array([10.0, 30.0, 2.0]),
    "loading_rate": np.array([10.0, 0.1, 1000.0]),
    "dwell_time": np.array([0.1, 1e-3, 3.0]),
    "unloading_rate": np.array([10.0, 300.0, 0.1]),
}


@pytest.mark.parametrize(
    ("text", "low", "high"), [("prony", 1, 4), ("broad", 2, 12), ("power-law", 8, 12), ("prony:2-3", 2, 3)]
)
def test_prior_is_the_stated_one(text, low, high):
    shares, times = Solids.of(text).draw(3000, seed=1)
    used = shares > 0.0
    assert set(used.sum(axis=1)) == set(range(low, high + 1))
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(np.sum(shares * np.log(times), axis=1), 0.0, atol=1e-12)
    assert np.all(np.diff(times, axis=1)[used[:, 1:]] > 0.0)
    assert np.all(times[~used] == 1.0)
    if text.startswith("prony"):
        assert shares[used].min() > 0.9 * LEAST_SHARE


def test_solids_do_not_depend_on_the_count():
    for text in ("prony", "power-law"):
        few, many = (Solids.of(text).draw(count, seed=5) for count in (10, 40))
        for first, second in zip(few, many, strict=True):
            np.testing.assert_array_equal(first, second[:10])


def test_one_term_is_todays_standard_linear_solid():
    shares, times = Solids.of("prony:1-1").draw(7, seed=0)
    np.testing.assert_array_equal(shares, 1.0)
    np.testing.assert_allclose(times, 1.0, rtol=1e-12)


def test_material_of_the_library_in_its_mean_time():
    solids, ratio = parse_solids("polyurea")
    shares, times = solids.draw(2, seed=0)
    assert shares.shape == (2, 4)
    assert ratio == pytest.approx(67.2 / (67.2 + 56.8378 + 113.299 + 241.517 + 291.782))
    np.testing.assert_allclose(np.sum(shares * np.log(times), axis=1), 0.0, atol=1e-9)
    assert Solids.of(solids.identity) == solids


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sylgard_184", "solids must relax; received sylgard_184, which is elastic"),
        ("burgers", "solids must be one of prony, broad, power-law or a spectrum; received 'burgers'"),
        ("prony:many", "terms must read LOW-HIGH, e.g. prony:1-4; received 'prony:many'"),
        ("prony:4-2", "terms must be a whole number from 4 to 100; received 2"),
    ],
)
def test_other_solids_are_refused(text, message):
    with pytest.raises(ValueError, match=message):
        parse_solids(text)


def test_spectra_are_those_of_the_materials():
    for text in ("prony", "power-law"):
        shares, times = Solids.of(text).draw(40, seed=2)
        strengths = shares * (1.0 - np.logspace(-2.0, -0.01, 40)[:, np.newaxis])
        moduli, relaxations = relaxation_spectra(strengths, times)
        for row, strength in enumerate(strengths):
            used = strength > 0.0
            expected = relaxation_spectrum(solid_of(strength, times[row]))
            np.testing.assert_allclose(np.stack([moduli[row, used], relaxations[row, used]]), expected, rtol=1e-11)
            assert not moduli[row, ~used].any()


def test_force_without_adhesion_is_the_hereditary_integral():
    solid = PronySeries([0.3, 0.5], [0.05, 4.0])
    moduli, times = relaxation_spectra(solid.strengths[np.newaxis], solid.times[np.newaxis])
    peak, up, dwelt, down = 9.0, 20.0, 0.3, 5.0
    memory, _, held, _, _ = held_to_unloading(peak, up, dwelt, moduli[0], times[0])
    travels, forces, *_ = to_crossing(peak, down, moduli[0], times[0], memory)
    turn = peak / up + dwelt

    def force(time):
        def relaxation(since):
            return 1.0 + np.sum(moduli[0] * np.exp(-since / times[0]))

        loading = quad(lambda s: relaxation(time - s) * 1.5 * up**1.5 * np.sqrt(s), 0.0, peak / up)[0]
        if time <= turn:
            return loading
        slope = [1.5 * down, peak + down * turn]
        return loading - quad(lambda s: relaxation(time - s) * slope[0] * np.sqrt(slope[1] - down * s), turn, time)[0]

    assert held[-1] == pytest.approx(force(turn), rel=1e-3)
    for index in (20, 40, len(travels) // 2):
        assert forces[index] == pytest.approx(force(turn + travels[index] / down), rel=3e-3, abs=1e-3 * forces[0])
    assert abs(force(turn + travels[-1] / down)) < 3e-3 * forces[0]


@pytest.mark.parametrize("share", [1e-6, 0.2, 0.7, 1.0])
def test_a_step_lies_at_the_pull_off(share):
    begin = measurement_grid(**PROTOCOLS, counts=PULL_OFF)[0][:, 29]
    travel = PROTOCOLS["peak_indentation"] + np.pi ** (2 / 3) * PROTOCOLS["tabor"]
    instant = begin + share * travel / PROTOCOLS["unloading_rate"]
    solid = {"strengths": np.full((3, 2), 0.4), "retardation_times": np.tile([0.1, 9.0], (3, 1))}
    times, _ = pull_off_grid(**PROTOCOLS, **solid, pull_off_time=instant)
    assert np.all(np.diff(times, axis=1) > 0.0)
    tolerance = 1e-9 if share > 1e-3 else 1e-2
    np.testing.assert_array_less(np.abs(times - instant[:, np.newaxis]).min(axis=1), tolerance * instant)


def test_file_of_a_campaign_of_solids(tmp_path):
    path = tmp_path / "solids.h5"
    options = ("--solids", "prony:1-4", "--steps", "pull-off", "--count", 40, "--seed", 3)
    box = ("--design", "sobol", "--modulus-ratio", "0.01:1")
    result = command("campaign", *options, *box, "--out", path, solver=stand_in.solve)
    assert result.exit_code == 0, result.stderr
    dataset = load_dataset(path)
    strengths, times = dataset.solids
    assert strengths.shape == times.shape == (40, 4)
    np.testing.assert_allclose(strengths.sum(axis=1), 1.0 - dataset.modulus_ratios, rtol=1e-12)
    campaign = Campaign.of(dataset.attributes["campaign"])
    cases = campaign.cases_of(dataset.columns["index"])
    instants, indentations = dataset.grid()
    for row, (scene, protocol) in enumerate(cases):
        np.testing.assert_allclose(scene.material.strengths, strengths[row][strengths[row] > 0.0], rtol=1e-12)
        force = stand_in.solve(scene, protocol).at(instants[row])
        np.testing.assert_allclose(dataset.force[row], force, rtol=1e-6)
    at_pull_off = np.abs(instants - dataset.scalars["pull_off_time"][:, np.newaxis]).min(axis=1)
    assert np.all(at_pull_off < 1e-9 * instants[:, -1])
    assert np.all(indentations[:, 0] == indentations[:, -1])
    assert verify(path, sample=3, workers=1, solver=stand_in.solve).agrees


def test_a_spectrum_of_ones_own_is_kept_in_the_file(tmp_path):
    solids, ratio = parse_solids("polyurea")
    campaign = Campaign(design=Design("log-uniform", {}, ratio, solids), count=5, counts=(22, 8, 72), steps="pull-off")
    run_here(campaign, path := tmp_path / "polyurea.h5", solver=stand_in.solve, workers=1)
    dataset = load_dataset(path)
    assert Campaign.of(dataset.attributes["campaign"]) == campaign
    np.testing.assert_allclose(dataset.solids[0].sum(axis=1), 1.0 - ratio, rtol=1e-12)


def test_solid_without_strength_is_elastic():
    assert solid_of(np.zeros(2), np.ones(2)) == Elastic()
    assert Scene(1.0, solid_of(np.array([0.9]), np.ones(1))).material.modulus_ratio == pytest.approx(0.1)
    assert StandardLinearSolid(0.1).times == solid_of(np.array([0.9]), np.ones(1)).times


def test_batches_are_a_fair_sample_of_the_box():
    campaign = Campaign(design=Design("sobol"), count=4096)
    first = next(iter(campaign.batches(campaign.indices, workers=1)))
    tabor = campaign.protocols["tabor"][[index for index, _ in first]]
    assert np.quantile(np.log(tabor), 0.25) == pytest.approx(np.log(0.2) + 0.25 * np.log(16.0), abs=0.15)
    share = Campaign(design=Design("sobol"), count=4096, shard=(1, 8))
    assert np.ptp(np.log(share.protocols["tabor"][share.indices])) < 0.3 * np.log(16.0)
