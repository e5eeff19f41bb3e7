"""Small made-up results."""

from surrogate.architectures.naming import paper_names

SPREAD = {"count": 3, "median": 0.02, "low": 0.01, "high": 0.03, "p95": 0.05, "largest": 0.06, "mean": 0.02}
UNKNOWN = dict.fromkeys(SPREAD)

PERCENTS = ("pull_off_force_percent", "hysteresis_percent", "pull_off_time_percent", "nmae_percent")
HISTORY = {"epoch": [1.0, 2.0, 3.0], "validation_mse": [0.3, 0.1, 0.2], "learning_rate": [1e-4, 1e-4, 5e-5]}


def comparison(trained, by_recipe=()):
    """A comparison of these models; those `by_recipe` were trained by the paper's recipe too, with twice the error."""
    stats = {"median": 2.0}
    models = {
        name: {
            "parameters": 1000 * (100 + rank),
            "mse": 1e-3 * (rank + 1),
            "mae": 1e-2 * (rank + 1),
            "dtw_rmse": 2e-2 * (rank + 1),
            "test": {"nmae_percent": {"median": 0.7}, "pull_off_force_percent": stats, "hysteresis_percent": stats},
            "recipe": {"name": "swift"},
            "training_trajectories": 9960,
            "epochs": 3,
            "core_seconds": 1800.0,
            "backend": "tensorflow",
            "device": "processor",
            "removed": None,
            "validation_mse": 0.2,
            "history": HISTORY,
        }
        for rank, name in enumerate(trained)
    }
    missing = [name for name in paper_names() if name not in trained]
    beside = {"M1-concat-large": models[trained[0]] | {"training_trajectories": 120_000}}
    twice = {name: {key: 2 * models[name][key] for key in ("mse", "mae", "dtw_rmse")} for name in by_recipe}
    beside |= {f"{name}-paper": models[name] | errors | {"recipe": {"name": "paper"}} for name, errors in twice.items()}
    common = {"missing": missing, "outdated": {}, "differences": {}, "beside": beside}
    mse = {name: errors["mse"] for name, errors in twice.items()}
    by_paper_recipe = {"trained": list(twice), "mse": mse}
    return {"models": models, **common, "comparison": {"ranking": list(trained)}, "by_paper_recipe": by_paper_recipe}


def outdated(compared, *names_):
    """The same comparison without these models, which are trained by another recipe."""
    kept = {name: model for name, model in compared["models"].items() if name not in names_}
    sentences = {name: f"{name} is left out: `make models` trains it again." for name in names_}
    ranking = {"ranking": list(kept)}
    differences = {name: ["recipe"] for name in names_}
    return compared | {"models": kept, "differences": differences, "outdated": sentences, "comparison": ranking}


def efficiency():
    folds = [{"history": HISTORY}, {"history": HISTORY}]
    shares = [{"percent": p, "mse_mean": 1.0 / p, "mse_sd": 0.1 / p, "folds": folds} for p in (75.0, 12.5)]
    shares.insert(1, {"percent": 25.0, "mse_mean": 0.04, "mse_sd": 0.0, "folds": folds[:1]})
    full = {"mse": 5e-3, "epochs": 15, "history": HISTORY}
    return {"config": {"architecture": "M1-concat"}, "full": full, "shares": shares}


def ranking(seeds):
    """A ranking with so many seeds of each model, by name; each errs more than the one before."""
    metrics = ("test_mse", "test_mae", "test_dtw_rmse", "pull_off_percent", "hysteresis_percent", "validation_mse")
    models, spread = {}, {}
    for rank, (name, count) in enumerate(seeds.items()):
        least = 5e-5 * (1.0 + rank)
        values = [least * (1.0 + 0.2 * seed) for seed in range(count)]
        models[name] = [{"seed": seed, **dict.fromkeys(metrics, value)} for seed, value in enumerate(values)]
        middle = sorted(values)[count // 2]
        ends = {"min": values[0], "median": middle, "max": values[-1], "low": 0.8 * middle, "high": 1.3 * middle}
        spread[name] = dict.fromkeys(metrics, ends)
    missing = {name: list(range(seeds.get(name, 0), 3)) for name in paper_names() if seeds.get(name, 0) < 3}
    orders = (("M2-concat", 0.5, "tie"), ("M3-concat", 1.0, "holds"), ("M4-concat", None, "not decided"))
    pairs = [
        {
            "claim": "best_model",
            "better": "M1-concat",
            "worse": worse,
            "seeds": [3, 3 if chance else 1],
            "probability": dict.fromkeys(metrics[:5], chance),
            "decision": decision,
        }
        for worse, chance, decision in orders
    ]
    claim = {"paper": "M1-concat", "first": "M1-concat", "level": ["M1-concat", "M2-concat"], "decision": "not decided"}
    common = {"confidence": 0.95, "resamples": 4000, "seeds_expected": 3, "left_out": {}}
    curves = {
        name: [[4 * row["test_mse"], 2 * row["test_mse"], 3 * row["test_mse"]] for row in rows]
        for name, rows in models.items()
    }
    return common | {
        "models": models,
        "curves": curves,
        "spread": spread,
        "missing": missing,
        "pairs": pairs,
        "claims": {"best_model": claim},
    }
