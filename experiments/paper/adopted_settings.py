"""Settings that the paper prescribes and this repository adopts, read from the code: ranges, recipe, layers, protocols.

`REPRODUCTION.md` compares them with the paper's statements. A row of that table shows that the setting is followed; it
does not show that a result is reproduced. The closed forms of the two elastic limits are included, as the code
evaluates them.
"""

import inspect
from typing import Any

import numpy as np

from bem.dataset.designs import PAPER_RANGES, QUANTITIES
from bem.dataset.measurement_steps import FMS
from bem.methods.closed_forms import dmt, jkr
from bem.methods.closed_forms import persson_brener as theory
from bem.problem.protocol import default_start_indentation
from experiments.common import Config
from experiments.paper_numbers import paper_rows
from surrogate.training.recipe import Recipe


def recipe() -> dict[str, Any]:
    """The recipe `paper`, with the keys of its plateau at the top level."""
    settings = Recipe.load("paper").as_dict()
    return settings | settings.pop("plateau")


def layers() -> dict[str, Any]:
    """Sizes of the layers of M1 and M4 that the paper states, from the built models."""
    import surrogate

    m1, m4 = surrogate.build("M1-FiLM"), surrogate.build("M4-FiLM")
    convolutions = [layer for layer in m4.layers if layer.name.endswith("first_convolution")]
    return {
        "lstm_units": ", ".join(str(m1.get_layer(name).units) for name in ("lstm_1", "lstm_2")),
        "film_context": m1.get_layer("film").hidden,
        "readout_units": m1.get_layer("readout_hidden").units,
        "tcn_widths": ", ".join(str(layer.filters) for layer in convolutions),
        "tcn_dilations": ", ".join(str(layer.dilation_rate[0]) for layer in convolutions),
        "tcn_blocks": len(convolutions),
        "tcn_kernel_size": convolutions[0].kernel_size[0],
        "tcn_dropout": m4.get_layer("block_1_first_dropout").rate,
    }


def crack_protocol() -> dict[str, Any]:
    """Quantities fixed in the protocols of the relaxed short-range limit, and the defaults of its length scale.

    Raises:
        ValueError: The protocols differ in more than the unloading rate.
    """
    first, *later = ({name: row[name] for name in QUANTITIES[:-1]} for row in paper_rows("persson_brener_protocols"))
    if any(protocol != first for protocol in later):
        raise ValueError(f"protocols must differ in the unloading rate alone; received {[first, *later]}")
    defaults = inspect.signature(theory.length_scale).parameters
    return first | {name: float(defaults[name].default) for name in ("alpha", "radius_over_gap")}


def study(feature_sets: Config) -> dict[str, Any]:
    """Read the settings."""
    from surrogate.data.features import channel_names

    radii = np.linspace(0.5, 3.0, 100_001)
    return {
        "ranges": {name: list(bounds) for name, bounds in PAPER_RANGES.items()},
        "start_over_tabor": default_start_indentation(1.0),
        "measurement_steps": sum(FMS),
        "steps_by_phase": ", ".join(map(str, FMS)),
        "channels": {name: len(channel_names(name)) for name in feature_sets["sets"]},
        "feature_sets": ", ".join(feature_sets["sets"]),
        "recipe": recipe(),
        "layers": layers(),
        "crack_protocol": crack_protocol(),
        "closed_forms": {
            "jkr_pull_off": float(jkr.force_from_contact_radius(radii).max()),
            "dmt_pull_off": float(dmt.force_from_indentation(0.0, 1.0)),
        },
    }
