"""Metadata of the data set in the Croissant format of ML Commons, version 1.0."""

import hashlib
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

CROISSANT_TERMS = (
    "citeAs",
    "column",
    "equivalentProperty",
    "extract",
    "field",
    "fileProperty",
    "fileObject",
    "fileSet",
    "format",
    "includes",
    "isLiveDataset",
    "jsonPath",
    "key",
    "md5",
    "parentField",
    "path",
    "recordSet",
    "references",
    "regex",
    "repeated",
    "replace",
    "samplingRate",
    "separator",
    "source",
    "subField",
    "transform",
)
CONTEXT = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "sc": "https://schema.org/",
    "dct": "http://purl.org/dc/terms/",
    "cr": "http://mlcommons.org/croissant/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "conformsTo": "dct:conformsTo",
    "data": {"@id": "cr:data", "@type": "@json"},
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    **{name: f"cr:{name}" for name in CROISSANT_TERMS},
}
"""The standard context of Croissant 1.0."""


def croissant(path: Path, dataset: Dataset) -> dict[str, Any]:
    """Metadata of the data set in the Croissant format."""
    return {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "name": "adhesive-viscoelastic-contact-trajectories",
        "description": (
            f"{len(dataset):,} force histories of a rigid sphere pressed into, held on and pulled off an adhesive "
            f"viscoelastic half-space of modulus ratio {dataset.attributes['modulus_ratio']:g}, computed by a boundary "
            "element method. One HDF5 file; docs/dataset.md describes it."
        ),
        "license": f"https://spdx.org/licenses/{LICENCE}.html",
        "version": "1.0.0",
        "datePublished": "2026-11-20",
        "creator": {"@type": "sc:Organization", "name": "the contact-trajectories contributors"},
        "citeAs": (
            "@misc{contact_trajectories, author = {the contact-trajectories contributors}, title = {Force histories of "
            "soft, adhesive, viscoelastic contacts}, year = {2026}, version = {1.0.0}}"
        ),
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
