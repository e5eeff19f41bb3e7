"""The planned speeds give the forces asked for."""

import pytest

from tests.examples.test_examples import example


def test_plan_release(capsys, tmp_path):
    module = example("plan_release")
    assert (module.HOLD, module.LET_GO) == (5e-3, 1e-3)
    for force in (module.LET_GO, module.HOLD):
        speed = module.speed_for(force)
        assert module.pull_off_force(speed) == pytest.approx(force, rel=0.02)
    assert module.speed_for(module.LET_GO) < module.speed_for(module.HOLD)
    with pytest.raises(ValueError, match="force must lie between"):
        module.speed_for(1.0)
    picture = tmp_path / "release.png"
    module.main(picture)
    assert picture.stat().st_size > 10_000
    said = capsys.readouterr().out
    assert "to hold 5 mN: retract faster than" in said
    assert "to let go below 1 mN: retract slower than" in said
