"""What a campaign leaves alone: other campaigns, and files of the user."""

import json

import pytest

from bem.dataset.campaign import Campaign
from bem.dataset.checkpoints import CampaignError
from bem.dataset.file import load_dataset
from bem.dataset.run import run_campaign
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import (
    await_parts,
    begun,
    parts,
    start_command,
)


def test_two_campaigns_on_one_file_exclude_each_other(plan, tmp_path):
    out = tmp_path / "data.h5"
    process = start_command("campaign", "--count", 4000, "--seed", 4, "--native", "--workers", 2, "--out", out)
    try:
        await_parts(out, process, 1)
        with pytest.raises(CampaignError, match="another campaign is writing"):
            run_campaign(Campaign(count=4000, seed=4, native=True), out, solver=stand_in.slow)
    finally:
        process.kill()
        process.communicate()
    with pytest.raises(ValueError, match=r"another one is under way.*: count 4000 there and 120 here"):
        run_campaign(plan, out, solver=stand_in.slow)


@pytest.mark.usefixtures("in_this_process")
def test_a_folder_of_the_user_is_left_alone(plan, tmp_path):
    out = tmp_path / "z.h5"
    folder = tmp_path / "z.h5.parts"
    folder.mkdir()
    (folder / "thesis.tex").write_text("x", encoding="utf-8")
    for replace in (False, True):
        with pytest.raises(ValueError, match=r"that folder holds 'thesis.tex', which no campaign wrote"):
            run_campaign(plan, out, solver=stand_in.solve, replace=replace)
    (folder / "away").symlink_to("nowhere")
    with pytest.raises(ValueError, match=r"that folder holds 'away', which no campaign wrote"):
        run_campaign(plan, out, solver=stand_in.solve)
    (folder / "away").unlink()
    (folder / "thesis.tex").rename(folder / "lock")
    with pytest.raises(ValueError, match="which no campaign wrote"):
        run_campaign(plan, out, solver=stand_in.solve)
    assert (folder / "lock").read_text(encoding="utf-8") == "x"
    assert sorted(tmp_path.rglob("*")) == [folder, folder / "lock"]


@pytest.mark.usefixtures("in_this_process")
def test_only_own_files_are_removed(plan, tmp_path, monkeypatch):
    out = tmp_path / "data.h5"
    (tmp_path / "data.h5.writing").write_text("mine", encoding="utf-8")
    place = begun(plan, out, monkeypatch)
    (own,) = place.glob("campaign-*")
    (own / "notes.txt").write_text("x", encoding="utf-8")
    (place / ".nfs0001").touch()  # as a file server does
    run_campaign(plan, out, solver=stand_in.solve)
    assert [path.name for path in own.iterdir()] == ["notes.txt"]
    assert (tmp_path / "data.h5.writing").read_text(encoding="utf-8") == "mine"


@pytest.mark.usefixtures("in_this_process")
def test_a_part_that_outlives_its_file_is_removed(plan, undisturbed, tmp_path, monkeypatch):
    out = tmp_path / "data.h5"
    place = begun(plan, out, monkeypatch)
    out.write_bytes(undisturbed.read_bytes())
    assert run_campaign(plan, out, solver=stand_in.solve).computed == 0
    assert not place.exists()


@pytest.mark.usefixtures("in_this_process")
def test_another_campaigns_parts_stay_until_the_one_that_replaces_it_is_complete(tmp_path, monkeypatch):
    first, second = Campaign(count=40, seed=1), Campaign(count=40, seed=2)
    out = tmp_path / "data.h5"
    place = begun(first, out, monkeypatch)
    kept = parts(out)
    begun(second, out, monkeypatch)
    assert set(kept) < set(parts(out))
    assert {json.loads(path.read_text())["seed"] for path in place.glob("*/campaign.json")} == {1, 2}
    assert run_campaign(first, out, solver=stand_in.solve).computed == 0
    assert len(load_dataset(out)) == 40
    assert place.exists()  # of the second, which may still continue
    assert run_campaign(second, out, solver=stand_in.solve, replace=True).computed == 0
    assert sorted(tmp_path.iterdir()) == [out]
