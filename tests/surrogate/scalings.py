"""Scalings of model directories that tests write by hand."""

import numpy as np

from surrogate.data.scaling import Scaling


def save_scaling(folder, data):
    """Write the scaling of the forces of a data set; its channels are random."""
    train = data.split().train
    channels = np.random.default_rng(0).random((*data.force[train].shape, 4))
    scaling = Scaling.fit(channels, tabor=data.protocols["tabor"][train], force=data.force[train])
    scaling.save(folder / "scaling.json")
