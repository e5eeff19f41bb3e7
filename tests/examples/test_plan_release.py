"""The planned speeds give the forces asked for."""

import pytest

from tests.examples.test_examples import example


def test_plan_release(capsys):
    module = example("plan_release")
    for force in (module.LET_GO, module.HOLD):
        speed = module.speed_for(force)
        assert module.pull_off_force(speed) == pytest.approx(force, rel=0.02)
    assert module.speed_for(module.LET_GO) < module.speed_for(module.HOLD)
    with pytest.raises(ValueError, match="force must lie between"):
        module.speed_for(1.0)
    module.main()
    assert "to hold 10 mN: retract faster than" in capsys.readouterr().out
