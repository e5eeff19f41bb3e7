"""Model directories of trainings that never ran."""

import json


def write_training(folder, variant, data):
    """The parts of a model directory that say where it comes from."""
    from surrogate.training.recipe import Recipe

    folder.mkdir(parents=True)
    data.split().with_fraction(variant.fraction, variant.fold).save(folder / "split.json")
    recipe = Recipe.load(variant.recipe).with_overrides(epochs=variant.epochs or None)
    (folder / "recipe.toml").write_text(recipe.to_toml(), encoding="utf-8")
    run = {"dataset_sha256": data.sha256, "backend": "tensorflow"}
    run |= {"features": variant.features, "architecture": variant.architecture}
    (folder / "run.json").write_text(json.dumps(run), encoding="utf-8")


def write_errors(folder, mse):
    """The rest of a model directory: errors, a learning curve, costs."""
    metrics = {"parameters": 1, "epochs": 2, "best_epoch": 1, "cpu_seconds": 1.0}
    metrics["test"] = {name: {"mean": mse} for name in ("mse", "mae", "dtw_rmse")}
    (folder / "metrics.json").write_text(json.dumps(metrics), encoding="utf-8")
    curve = "epoch,train_mse,validation_mse,cpu_seconds\n1,0.1,0.1,1\n"
    (folder / "history.csv").write_text(curve, encoding="utf-8")
    run = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    run |= {"versions": {}, "training_trajectories": 32}
    (folder / "run.json").write_text(json.dumps(run), encoding="utf-8")
