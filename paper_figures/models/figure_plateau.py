"""What the rule of the plateau does: one model by the paper's recipe, by its words, and by ours.

Keras's default counts a decrease of the validation error only if it is larger than 1e-4, which is soon more than the
error is.
"""

from typing import Any

from matplotlib.figure import Figure

from experiments.published_models import PAPER_TRAINED, REFERENCE, WORDED
from paper_figures.style import drawing, models_style

LOOKS = {
    "paper's recipe, Keras's default": {"color": drawing.BLACK},
    "paper's recipe, as worded": {"color": drawing.FAMILIES[1]},
    "swift": {"color": drawing.FAMILIES[0], "linestyle": models_style.OURS},
}


def compose(model_comparison: Any) -> Figure:
    """Draw (a) the validation error and (b) the learning rate over the epochs, of the trainings that are published.

    Raises:
        FileNotFoundError: The model is not trained by the paper's recipe.
    """
    beside = model_comparison["beside"]
    if PAPER_TRAINED[REFERENCE] not in beside:
        raise FileNotFoundError(f"{PAPER_TRAINED[REFERENCE]} is not published; `make model-paper-recipe` trains it")
    trainings = (beside[PAPER_TRAINED[REFERENCE]], beside.get(WORDED), model_comparison["models"].get(REFERENCE))
    drawn, (errors, rates) = drawing.panels(1, 2, sharex=True, height=2.5)
    for (label, look), training in zip(LOOKS.items(), trainings, strict=True):
        if training:
            history = training["history"]
            errors.plot(history["epoch"], history["validation_mse"], linewidth=0.8, label=label, **look)
            rates.plot(history["epoch"], history["learning_rate"], linewidth=1.2, label=label, **look)
    errors.set(xlabel="epoch", ylabel="validation MSE", xscale="log", yscale="log")
    rates.set(xlabel="epoch", ylabel="learning rate", yscale="log", ylim=(5e-8, None))  # ours ends at zero
    drawing.log_labels(errors.xaxis)
    errors.legend(loc="upper right")
    return drawn
