"""Which effects a scene has, and the scene without some of them."""

from bem import HardContact, LoadingProtocol, PronySeries, Scene, StandardLinearSolid
from bem.problem.effects import Effects, choices, reduced

SLS = StandardLinearSolid(0.1)
DEEP = LoadingProtocol(peak_indentation=900.0, loading_rate=1.0, dwell_time=0.1, unloading_rate=1.0)


def test_the_choices_of_a_scene():
    assert [str(effects) for effects in choices(Scene(1.0))] == ["elastic, without adhesion", "elastic, adhesive"]
    assert len(choices(Scene(1.0, adhesion=HardContact()))) == 1
    two = [str(effects) for effects in choices(Scene(1.0, PronySeries([0.2, 0.2], [1.0, 2.0])))]
    assert two[0] == "elastic glassy, without adhesion"
    assert two[-1] == "viscoelastic, adhesive"
    assert two.count("1 of 2 terms, adhesive") == 2
    every = choices(Scene(1.0, SLS, spring=2.0))
    assert len(every) == 2 * len(choices(Scene(1.0, SLS)))
    assert every[-1] == Effects(adhesion=True, first=0, last=1, of=1, spring=True)
    assert every[-1].count == 3
    frozen, _ = reduced(Scene(1.0, SLS, spring=2.0), DEEP, Effects(True, 0, 0, 1, True))
    assert frozen.spring == 2.0  # force and indentation keep their units
