from bem.methods.outcomes import DETACHED, NO_EQUILIBRIUM, OUT_OF_WORK, Outcome


def test_each_end_has_its_own_sentence():
    assert len({outcome.status(1.0) for outcome in Outcome}) == len(Outcome)


def test_budget_stands_in_the_sentence():
    assert "budget of 3e+11 multiply-adds" in OUT_OF_WORK.status(3e11)


def test_finer_meshes_are_for_what_they_mend():
    assert NO_EQUILIBRIUM.needs_a_finer_mesh
    assert not OUT_OF_WORK.needs_a_finer_mesh
    assert not DETACHED.needs_a_finer_mesh
