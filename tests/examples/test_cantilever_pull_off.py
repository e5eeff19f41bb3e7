"""What the example says of cantilevers is what it computes."""

import numpy as np
import pytest

from tests.examples.test_examples import example


def test_cantilever_pull_off(capsys, tmp_path):
    module = example("cantilever_pull_off")
    picture = tmp_path / "pulls.png"
    module.main(picture)
    assert picture.stat().st_size > 10_000
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[1:]] == ["500", "3", "40", "rigid"]
    pulls = [module.pull(stiffness, "draft") for stiffness in module.CANTILEVERS]
    elastic = np.array([each.elastic.pull_off_force for each in pulls])
    np.testing.assert_allclose(elastic, elastic[-1], rtol=0.03)
    slow_to_fast = np.array([each.viscoelastic.pull_off_force for each in pulls])
    assert np.all(np.diff(slow_to_fast) > 0.0)
    assert slow_to_fast[-1] > 1.1 * slow_to_fast[0]
    travels = [each.travel for each in pulls]
    assert travels[0] > travels[1] > travels[2]
    soft = pulls[0].viscoelastic
    assert soft.stage.min() == pytest.approx(-module.AWAY)
    np.testing.assert_allclose(soft.stage, soft.indentation - soft.tension / 0.5, atol=1e-18)
