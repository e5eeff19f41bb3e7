"""The planned dwell makes pull-off insensitive to the approach, and a shorter one does not."""

import numpy as np

from tests.examples.test_examples import example


def test_plan_dwell(capsys, tmp_path):
    module = example("plan_dwell")
    picture = tmp_path / "dwell.png"
    module.main(picture)
    assert picture.stat().st_size > 10_000
    answer = capsys.readouterr().out.splitlines()[-1]
    dwells = np.array(module.DWELLS)
    forces = np.array([[module.pull_off_force(v, dwell) for v in module.APPROACHES] for dwell in dwells[[0, -2, -1]]])
    assert np.all(np.diff(forces[0]) < 0.0)  # the faster the approach, the less adhesion without a dwell
    shares = module.spread(forces)
    assert shares[0] > 0.3
    assert shares[-1] < module.TOLERANCE
    assert "wait" in answer


def test_the_shortest_dwell_is_the_first_of_those_that_all_suffice():
    module = example("plan_dwell")
    steady = np.ones((len(module.DWELLS), 2))
    assert module.shortest(steady) == 0.0
    steady[3, 0] = 1.1
    assert module.shortest(steady) == module.DWELLS[4]
    steady[-1, 0] = 1.1
    assert module.shortest(steady) is None
