"""Metadata of the data set in the Croissant format of ML Commons, version 1.0."""

import hashlib
import json
from pathlib import Path
from typing import Any

from bem.dataset.file import Dataset

METADATA = "dataset.croissant.json"
LICENCE = "BSD-3-Clause"
ARRAYS = {
    "fms/force": "force at the measurement steps, in pi R dgamma, tension positive",
    "protocols/tabor": "Tabor parameter",
    "protocols/peak_indentation": "largest indentation, in h0",
    "protocols/loading_rate": "speed of loading, in h0 per retardation time",
    "protocols/dwell_time": "time held at the peak, in retardation times",
    "protocols/unloading_rate": "speed of unloading, in h0 per retardation time",
    "scalars/pull_off_force": "largest force while unloading, in pi R dgamma",
    "scalars/hysteresis": "loop area, in h0 pi R dgamma",
}

HEAD = Path(__file__).with_name("croissant_head.json")
"""The standard context of Croissant 1.0, and what of the metadata does not depend on the file."""


def croissant(path: Path, dataset: Dataset) -> dict[str, Any]:
    """Metadata of the data set in the Croissant format."""
    return json.loads(HEAD.read_text(encoding="utf-8")) | {
        "description": (
            f"{len(dataset):,} force histories of a rigid sphere pressed into, held on and pulled off an adhesive "
            f"viscoelastic half-space of modulus ratio {dataset.attributes['modulus_ratio']:g}, computed by a boundary "
            "element method. One HDF5 file; docs/dataset.md describes it."
        ),
        "license": f"https://spdx.org/licenses/{LICENCE}.html",
        "variableMeasured": [
            {
                "@type": "sc:PropertyValue",
                "name": name,
                "description": f"{words}; shape {dataset.columns[name].shape}",
            }
            for name, words in ARRAYS.items()
        ],
        "distribution": [
            {
                "@type": "cr:FileObject",
                "@id": path.name,
                "name": path.name,
                "contentUrl": path.name,
                "contentSize": f"{path.stat().st_size} B",
                "encodingFormat": "application/x-hdf5",
                "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
            }
        ],
    }
