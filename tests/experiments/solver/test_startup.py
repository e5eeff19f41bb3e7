"""What a command costs before it computes, beside another revision."""

from experiments.solver import startup
from experiments.solver.solver_processes import ROOT


def test_a_ratio_of_startups_is_now_over_before(monkeypatch, capsys):
    monkeypatch.setattr(startup, "checked_out", lambda _, folder: folder)
    monkeypatch.setattr(startup, "processor_seconds", lambda source, _: 1.0 if source == ROOT else 4.0)
    startup.main("HEAD", 1)
    assert capsys.readouterr().out.splitlines()[-1].split() == ["ratio", "0.25", "0.25"]
