"""The trained models compared: errors, sizes, learning curves, costs, and which of the 18 are missing.

The study reads the published model directories; it trains and evaluates nothing. Only models trained in the same way
are compared: on the data set, with the split and the recipe of the reference model; the seed may differ. Models that
were trained differently on purpose (another recipe, more data, fewer epochs, a family beyond the paper's) are in a
separate list; they have the same held-out part. Source: the paper's section "Model-family selection" and its appendices
on conditioning and learning curves.
"""

from typing import Any

from experiments.common import Dataset, Models, dataset_digest
from experiments.published_models import (
    PAPER_TRAINED,
    PAPER_TRAINED_CONTENDERS,
    outdated,
    published,
    read_model,
    training_differences,
)
from surrogate.architectures.naming import paper_names


def by_paper_recipe(beside: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """The trainings that the paper's recipe ended; what needs one that is missing is `None`."""
    labelled = {name: label for name, label in PAPER_TRAINED_CONTENDERS.items() if label in beside}
    finished = {name: beside[label] for name, label in labelled.items() if beside[label]["ended_by"] == "recipe"}
    trained = {name: model for name, model in finished.items() if name in PAPER_TRAINED}
    complete = len(trained) == len(PAPER_TRAINED)
    inputs = {name: finished.get(f"features-{name}", {}).get("validation_mse") for name in "ABCD"}
    return {
        "trained": list(trained),
        "mse": {name: model["mse"] for name, model in finished.items()},
        "most_epochs": max(model["epochs"] for model in trained.values()) if complete else None,
        "validation_mse": inputs,
        "a_over_d": inputs["A"] / inputs["D"] if inputs["A"] and inputs["D"] else None,
        "all_improve_over_a": max(inputs[name] for name in "BCD") < inputs["A"] if all(inputs.values()) else None,
    }


def study(models: Models, dataset: Dataset) -> dict[str, Any]:
    """Compare the published models.

    Raises:
        FileNotFoundError: No paper model was trained on the data set.
    """
    lineages, digest = published(models), dataset_digest(dataset)
    old = outdated(lineages, digest, models)
    read = {name: read_model(models / name) for name in lineages if name not in old}
    ranked = {name: run for name, run in read.items() if name in paper_names()}
    if not ranked:
        lacking = f"no model trained on {str(dataset)!r} in {str(models)!r}; `make models` trains the 18."
        raise FileNotFoundError(" ".join([lacking, *old.values()]))
    beside = {
        name: {"architecture": lineages[name].architecture, **run} for name, run in read.items() if name not in ranked
    }
    missing = [name for name in paper_names() if name not in lineages]
    return {
        "dataset_sha256": digest,
        "models": ranked,
        "beside": beside,
        "missing": missing,
        "outdated": old,
        "differences": training_differences(lineages, digest),
        "expected": len(paper_names()),
        "comparison": {
            "ranking": sorted(ranked, key=lambda name: ranked[name]["mse"]),
            "most_epochs": max(model["epochs"] for model in ranked.values()),
        },
        "by_paper_recipe": by_paper_recipe(beside),
    }
