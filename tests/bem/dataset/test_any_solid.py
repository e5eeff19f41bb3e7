"""Data sets of physical steps and of a modulus ratio for each trajectory."""

import numpy as np
import pytest

from bem import LoadingProtocol, Scene, StandardLinearSolid, simulate
from bem.dataset.designs import Design
from bem.dataset.file import load_dataset
from bem.dataset.measurement_steps import PHYSICAL
from bem.dataset.physical_steps import physical_grid
from bem.dataset.sealed_file import DamagedFileError
from bem.dataset.verification import verify
from surrogate.data.dataset import TrajectoryDataset
from tests.bem.dataset.helpers import altered, command

OPTIONS = ("--design", "sobol", "--count", "4", "--accuracy", "draft", "--range", "peak_indentation=2:5")
ANY = (*OPTIONS, "--modulus-ratio", "0.02:1", "--steps", "physical")


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    out = tmp_path_factory.mktemp("campaign") / "any.h5"
    done = command("campaign", *ANY, "--out", out, solver=simulate)
    assert done.exit_code == 0, done.output
    return out


def test_each_trajectory_is_of_its_own_solid_on_its_own_steps(path):
    dataset = load_dataset(path)
    drawn = Design("sobol", {"peak_indentation": (2.0, 5.0)}, (0.02, 1.0)).protocols(4, seed=0)
    np.testing.assert_array_equal(dataset.modulus_ratios, drawn["modulus_ratio"])
    assert (dataset.steps, dataset.counts) == ("physical", PHYSICAL)
    times, indentations = dataset.grid()
    np.testing.assert_array_equal((times, indentations), physical_grid(**drawn))
    row = int(np.argmin(dataset.modulus_ratios))
    rest = {name: float(values[row]) for name, values in dataset.protocols.items()}
    scene = Scene(rest.pop("tabor"), StandardLinearSolid(float(drawn["modulus_ratio"][row])))
    again = simulate(scene, LoadingProtocol(**rest), "draft")
    np.testing.assert_allclose(dataset.force[row], again.at(times[row]), rtol=1e-5, atol=1e-5)


@pytest.mark.usefixtures("in_this_process")
def test_it_is_verified_checked_and_learned_from_like_any_other(path, tmp_path):
    assert verify(path, sample=4).agrees
    dataset = TrajectoryDataset.load(path)
    assert dataset.modulus_ratio is None
    np.testing.assert_array_equal(dataset.modulus_ratios(np.array([2, 0])), dataset.protocols["modulus_ratio"][[2, 0]])
    np.testing.assert_array_equal(dataset.grid(np.array([1])), [values[1:2] for values in load_dataset(path).grid()])
    with pytest.raises(DamagedFileError, match=r"without /protocols/modulus_ratio"):
        load_dataset(altered(path, tmp_path, lambda file: file.__delitem__("protocols/modulus_ratio")))


def test_other_steps_or_solids_are_another_data_set_and_one_without_them_says_so_as_before(path, tmp_path):
    out, digests = tmp_path / "other.h5", {TrajectoryDataset.load(path).sha256}
    for options in ([], ["--steps", "physical"], ["--modulus-ratio", "0.02:1"], ["--modulus-ratio", "0.3"]):
        assert command("campaign", *OPTIONS, *options, "--out", out, "--replace", solver=simulate).exit_code == 0
        digests.add(TrajectoryDataset.load(out).sha256)
    assert len(digests) == 5
    dataset = load_dataset(out)
    assert "steps" not in dataset.attributes["campaign"]
    assert (dataset.steps, "protocols/modulus_ratio" in dataset.columns) == ("uniform", False)
    np.testing.assert_array_equal(dataset.modulus_ratios, 0.3)
