"""Tables: errors of each model over its seeds, and the paper's rankings with the probability of each order."""

from typing import Any

from paper_figures.style.writing import Table, caption, number

METRICS = {
    "test_mse": "MSE",
    "test_mae": "MAE",
    "test_dtw_rmse": "DTW-RMSE",
    "pull_off_percent": "Pull-off, median (%)",
    "hysteresis_percent": "Hysteresis, median (%)",
}
SAYS = {
    "best_model": "best model",
    "second_family": "strongest other family",
    "concatenation_suffices": "concatenation suffices",
    "best_input": "best input representation",
    "d_better_than_c": "D better than C",
}


def says(claim: str) -> str:
    """A ranking in words."""
    ranking, _, family = claim.partition("/")
    return f"best conditioning of {family}" if family else SAYS[ranking]


def chance_text(chance: float, resamples: int) -> str:
    """A probability as text, with a bound where the number of resamples limits it."""
    least = max(1e-3, 1.0 / resamples)
    if least < chance < 1.0 - least:
        return f"{chance:.3f}"
    return f"> {1.0 - least:.3f}" if chance > 0.5 else f"< {least:.3f}"


def errors_table(ranking: Any, by_recipe: dict[str, Any]) -> Table:
    """One row for each model that has a seed, best first; `by_recipe` are the errors by the paper's recipe.

    Errors are medians over the seeds, with their interval in brackets, and the extremes if there are several seeds.
    """
    rows = []
    for name, spread in sorted(ranking["spread"].items(), key=lambda pair: pair[1]["test_mse"]["median"]):
        count, cells = len(ranking["models"][name]), []
        for interval in (spread[metric] for metric in METRICS):
            cells.append(f"{number(interval['median'])} [{number(interval['low'])}, {number(interval['high'])}]")
            cells[-1] += f", seeds {number(interval['min'])} to {number(interval['max'])}" if count > 1 else ""
        first = [name, number(by_recipe[name]) if name in by_recipe else "-", f"{count} of {ranking['seeds_expected']}"]
        rows.append([*first, *cells, number(spread["validation_mse"]["median"])])
    left_out = " ".join(f"{label} is {sentence}." for label, sentence in ranking["left_out"].items())
    note = caption("ranking", confidence=100 * ranking["confidence"], resamples=ranking["resamples"])
    header = ["Model", "MSE by the paper's recipe", "Seeds", *METRICS.values(), "Validation MSE"]
    return Table(header, rows, f"{note} {left_out}".strip())


def orders_table(ranking: Any) -> Table:
    """One row for each ranking, followed by one for each of its orders that the seeds decide."""
    rows = []
    for name, claim in ranking["claims"].items():
        pairs = [pair for pair in ranking["pairs"] if pair["claim"] == name]
        decided = [pair for pair in pairs if pair["probability"]["test_mse"] is not None]
        rows.append([says(name), f"{claim['paper']} first", f"{len(decided)} of {len(pairs)}", "-", claim["decision"]])
        rows += [
            [
                "",
                f"{pair['better']} before {pair['worse']}",
                " and ".join(map(str, pair["seeds"])),
                chance_text(pair["probability"]["test_mse"], ranking["resamples"]),
                pair["decision"],
            ]
            for pair in decided
        ]
    sure = ranking["confidence"]
    note = caption("ranking-orders", resamples=ranking["resamples"], confidence=sure, tail=1.0 - sure)
    return Table(["Ranking", "Order", "Seeds, or orders decided", "P", "Decision"], rows, note)


def compose(ranking: Any, model_comparison: Any) -> dict[str, Table]:
    """Write both tables."""
    by_recipe = model_comparison["by_paper_recipe"]["mse"]
    return {"ranking": errors_table(ranking, by_recipe), "ranking-orders": orders_table(ranking)}
