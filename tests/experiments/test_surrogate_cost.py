"""Which surrogates are outdated, and whose measured seconds count, from small model directories."""

import json

from experiments import amortisation, surrogate_cost
from experiments.lineage import dataset_digest


def write_model(folder, dataset, *, recipe="swift", **run):
    folder.mkdir(parents=True)
    for name in surrogate_cost.FILES:
        (folder / name).write_text(folder.name, encoding="utf-8")
    split = {"seed": 0, "train": [0], "validation": [1], "test": [2]}
    (folder / "split.json").write_text(json.dumps(split), encoding="utf-8")
    (folder / "recipe.toml").write_text(f'name = "{recipe}"\n', encoding="utf-8")
    content = {"architecture": "M1-concat", "features": "D", "backend": "tensorflow", "cpu_seconds": 120.0}
    content |= {"dataset_sha256": dataset_digest(dataset)}
    (folder / "run.json").write_text(json.dumps(content | run), encoding="utf-8")


def test_models_of_any_name_are_outdated_by_the_comparisons_rule(dataset, tmp_path):
    write_model(tmp_path / "M1-concat", dataset)
    write_model(tmp_path / "M1-FiLM", dataset, recipe="other")
    write_model(tmp_path / "M1-gated", dataset, features="A")
    write_model(tmp_path / "M1-concat-large", dataset, dataset_sha256="0")
    write_model(tmp_path / "M1-concat-paper", dataset, recipe="paper")
    write_model(tmp_path / "M2-concat", dataset)
    (tmp_path / "M2-concat" / "run.json").write_text("{", encoding="utf-8")
    assert surrogate_cost.left_out(tmp_path, dataset) == {
        "M1-FiLM": ["recipe"],
        "M1-concat-large": ["data set"],
        "M1-gated": ["feature set"],
    }
    assert surrogate_cost.outdated(tmp_path, dataset) == ["M1-FiLM", "M1-gated"]


def test_seconds_of_a_model_that_was_trained_anew_do_not_count(dataset, tmp_path):
    models = tmp_path / "models"
    for name in ("M1-concat", "M1-FiLM", "M1-gated", "M2-concat"):
        write_model(models / name, dataset)
    digests = {name: surrogate_cost.weights_digest(models / name) for name in ("M1-concat", "M1-FiLM")}
    (models / "M1-FiLM" / "model.weights.h5").write_text("trained anew", encoding="utf-8")
    common = {"kind": "surrogate", "way": "ONNX single", "errors": {}, "seconds": {"mean": 1e-3}}
    tools = [{"model": name, "setting": name, "weights_sha256": digest} | common for name, digest in digests.items()]
    tools.append({"model": "M1-gated", "setting": "M1-gated"} | common)
    cost = tmp_path / "cost.json"
    cost.write_text(json.dumps({"tools": tools}), encoding="utf-8")
    amortisation.main(cost, dataset, models, tmp_path / "out.json")
    content = json.loads((tmp_path / "out.json").read_text(encoding="utf-8"))
    assert [line["name"] for line in content["lines"] if line["kind"] == "surrogate"] == ["M1-concat"]
    assert content["retrained"] == ["M1-FiLM", "M1-gated"]
    assert content["unmeasured"] == ["M2-concat"]
