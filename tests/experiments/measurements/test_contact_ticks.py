import numpy as np
import pytest

from bem import LoadingProtocol, Scene, StandardLinearSolid
from experiments.measurements import contact_ticks
from experiments.measurements.cases import Case


@pytest.mark.parametrize(("dwell", "count"), [(0.01, 56), (10.0, 100)])
def test_a_protocol_is_followed_in_ticks_up_to_the_longest_number(dwell, count, monkeypatch):
    monkeypatch.setattr(contact_ticks, "LONGEST", 100)
    protocol = LoadingProtocol(peak_indentation=0.2, loading_rate=100.0, dwell_time=dwell, unloading_rate=100.0)
    spent = contact_ticks.ticks(Case(Scene(1.0, StandardLinearSolid(0.1)), protocol), np.random.default_rng(0))
    assert len(spent) == count
    assert min(spent) > 0.0


def test_the_shares_are_found(monkeypatch):
    monkeypatch.setattr(contact_ticks, "ticks", lambda *_: [2e-4, 4e-4, 5e-3, 3e-4])
    content = contact_ticks.study(count=2)
    assert (content["count"], content["below_a_millisecond"]) == (8, 0.75)
