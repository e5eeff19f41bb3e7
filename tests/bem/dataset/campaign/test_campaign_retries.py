from collections import Counter

import numpy as np
import pytest

from bem.dataset.campaign.plan import Campaign
from bem.dataset.campaign.run import run_campaign
from bem.dataset.file import load_dataset
from tests.bem.dataset.campaign import stand_in

# Solvers that read the environment again each time: workers know only the one they were started in.
pytestmark = pytest.mark.usefixtures("in_this_process")


def test_failed_trajectories_are_computed_again_when_asked(tmp_path, monkeypatch):
    out, mended = tmp_path / "data.h5", tmp_path / "mended"
    monkeypatch.setenv("STAND_IN_MARKER", str(mended))
    plan = Campaign(count=200, seed=1)
    tabor = plan.protocols["tabor"]
    deep = int(np.sum(tabor > 3.0))

    def run(**options):
        return run_campaign(plan, out, solver=stand_in.fails_until_mended, workers=1, **options)

    assert sum(run().failures.values()) == deep
    assert run().computed == 0
    again = run(retry_failed=True)
    assert (again.computed, sum(again.failures.values())) == (deep, deep)
    mended.touch()
    before = load_dataset(out)
    found = run(retry_failed=True)
    assert (found.computed, found.count, found.failures) == (deep, 200, Counter())
    after = load_dataset(out)
    kept = before.completed
    np.testing.assert_array_equal(after.force[kept], before.force[kept])
    assert after.attributes["core_seconds"] > before.attributes["core_seconds"]
    assert run(retry_failed=True).computed == 0
    assert sorted(tmp_path.iterdir()) == [out, mended]


def test_an_interrupted_retry_continues(tmp_path, monkeypatch):
    out, mended = tmp_path / "data.h5", tmp_path / "mended"
    monkeypatch.setenv("STAND_IN_MARKER", str(mended))
    plan = Campaign(count=200, seed=1)

    def run(**options):
        return run_campaign(plan, out, solver=stand_in.fails_until_mended, workers=1, **options)

    failed = sum(run().failures.values())
    mended.touch()

    def stop(done, _):
        if done > 200 - failed:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(retry_failed=True, progress=stop)
    assert run().computed == 0  # and leaves what the retry saved
    found = run(retry_failed=True)
    assert 0 < found.computed < failed
    assert found.failures == Counter()
    assert sorted(tmp_path.iterdir()) == [out, mended]
