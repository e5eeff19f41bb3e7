"""What commands cost, on small and made-up cases."""

from experiments import harness
from experiments.measurements import limits


def test_seconds_are_of_the_command_alone():
    sum(number**2 for number in range(3_000_000))  # of this process
    assert 0.05 < harness.of_command("--version")[1] < 2.0


def test_a_prescribed_force_is_met():
    assert 0.0 < limits.force_error(1, count=3) < 1e-3


def test_first_elastic_contact_costs_most():
    seconds = {"elastic": [{"seconds": 0.05}, {"seconds": 5e-4}]}
    assert limits.elastic_text(seconds).startswith("50 ms of processor time the first time, 0.5 ms afterwards")
