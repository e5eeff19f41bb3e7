"""How a march along a protocol ends, and what a status says of it."""

from enum import IntEnum

_TIGHTER = "try a tighter accuracy"


class Outcome(IntEnum):
    """The end of a march: its number in kernels, its sentence and its advice."""

    COMPLETED = 0, "completed"
    NO_EQUILIBRIUM = 1, "no stable equilibrium found", _TIGHTER
    OUT_OF_WORK = (
        2,
        "stopped at the budget of {:g} multiply-adds",
        "try a looser accuracy, a shorter protocol or a larger most_work",
    )
    UNPHYSICAL = 3, "force beyond what the history allows", _TIGHTER
    DETACHED = 4, "detached: no contact bears the prescribed force"
    PAUSED = 5, "paused"
    NOT_FINITE = 6, "a number of the history is not finite", _TIGHTER
    TOO_MUCH_TENSION = 7, "tension beyond what the adhesion allows", _TIGHTER
    NOT_BALANCED = 8, "work beyond what the contact stores and loses", _TIGHTER

    sentence: str
    advice: str

    def __new__(cls, number: int, sentence: str, advice: str = "") -> "Outcome":  # noqa: D102
        outcome = int.__new__(cls, number)
        outcome._value_, outcome.sentence, outcome.advice = number, sentence, advice
        return outcome

    def status(self, budget: float) -> str:
        """What the trajectory says of its end, after a march with that budget of multiply-adds."""
        return "; ".join(filter(None, (self.sentence.format(budget), self.advice)))

    @property
    def needs_a_finer_mesh(self) -> bool:
        """Whether the same protocol may end otherwise at a tighter accuracy."""
        return self.advice == _TIGHTER


(
    COMPLETED,
    NO_EQUILIBRIUM,
    OUT_OF_WORK,
    UNPHYSICAL,
    DETACHED,
    PAUSED,
    NOT_FINITE,
    TOO_MUCH_TENSION,
    NOT_BALANCED,
) = Outcome
