"""The trained models compared: figure 5, learning curves, errors, the rule of the plateau, and the table."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bem.plots import COLOURS
from experiments.paper.model_comparison import PAPER_TRAINED, REFERENCE, WORDED
from paper_figures.style import drawing, models_style
from paper_figures.style.writing import Table, caption, number
from surrogate.architectures.naming import PAPER_FAMILIES, paper_names

SHOWN = ("FiLM", "gated")
"""Conditionings, one panel each."""


def draw_curves(axes: Axes, content: Any, conditioning: str, ranking: Any = None) -> None:
    """Draw the validation MSE over the epochs of the models of a conditioning in `model_comparison`, by both recipes.

    A model with two seeds or more is drawn as their median, in a band from the least to the largest. A training by the
    paper's recipe has a marker with a black edge.
    """
    models = content["models"]
    for name, found in models_style.trained_by_paper_recipe(content).items():
        if name.endswith(conditioning):
            models_style.draw_curve(axes, found["history"], models_style.recipe_marker(name), "_")
    names = {family: f"{family}-{conditioning}" for family in PAPER_FAMILIES}
    for family, name in names.items():
        if name not in models:
            continue
        look = models_style.marker(name)
        if models_style.seeds_of(ranking, name) >= models_style.SEVERAL:
            models_style.draw_curves_of_seeds(axes, ranking["curves"][name], look, family)
        else:
            models_style.draw_curve(axes, models[name]["history"], look, family)
    axes.set(xlabel="epoch", ylabel="validation MSE", xscale="log", yscale="log")
    drawing.log_labels(axes.xaxis)


def figure_learning_curves(model_comparison: Any, ranking: Any = None) -> Figure:
    """Validation curves of the FiLM and gated models; those of the concatenated models are in figure 5 (a).

    Raises:
        FileNotFoundError: None of the models is published.
    """
    shown = [name for name in paper_names() if name.endswith(SHOWN)]
    if set(shown) <= set(model_comparison["missing"]):
        raise FileNotFoundError(f"no {' or '.join(SHOWN)} model is published; `make models` trains them")
    drawn, panels = drawing.panels(1, 2, sharex=True, sharey=True, height=2.7)
    theirs = [models_style.recipe_handle()] if models_style.trained_by_paper_recipe(model_comparison) else []
    for axes, conditioning in zip(panels, SHOWN, strict=True):
        draw_curves(axes, model_comparison, conditioning, ranking)
        if axes.lines:
            axes.legend(handles=[*axes.get_legend_handles_labels()[0], *theirs], loc="upper right", ncols=2)
        axes.set_title(conditioning, loc="right")
    models_style.write_states(drawn, model_comparison, ranking, shown)
    return drawn


def draw_models(axes: Axes, content: Any, x: str, y: str, ranking: Any = None, *, factor: float = 1.0) -> None:
    """Draw one marker for each training by the paper's recipe and for each by ours, in `model_comparison`.

    A model with two seeds is drawn as their median and range; `factor` scales parameters.
    """
    for name, found in models_style.trained_by_paper_recipe(content).items():
        axes.plot(factor * found[x], found[y], **models_style.recipe_marker(name))
    for name, found in content["models"].items():
        place = factor * found[x] if x == "parameters" else f"test_{x}"
        if not models_style.draw_spread(axes, ranking, name, place, f"test_{y}"):
            axes.plot(factor * found[x], found[y], label=name, zorder=3, **models_style.marker(name))


def figure_mse_mae(model_comparison: Any, ranking: Any = None) -> Figure:
    """Held-out MSE against MAE of every trained model, with the spread over its seeds, and of the paper's best model.

    The second panel is the part of the first that holds the models that are trained by our recipe.
    """
    paper = drawing.paper_values("reference_model")
    ours = model_comparison | {"by_paper_recipe": {"trained": []}}
    drawn, panels = drawing.panels(1, 2, width_ratios=(1.0, 1.6), height=3.2)
    panels[0].plot(paper["mse"], paper["mae"], **models_style.paper_marker(paper["name"]))
    for axes, shown in zip(panels, (model_comparison, ours), strict=True):
        draw_models(axes, shown, "mse", "mae", ranking)
        axes.set(xscale="log", yscale="log", xlabel="held-out MSE of the scaled force")
        axes.set_ylabel("held-out MAE of the scaled force")
        axes.margins(0.1)
        drawing.log_labels(axes.xaxis)
        drawing.log_labels(axes.yaxis)
    handles = models_style.handles(paper["name"])
    drawn.legend(handles=handles, loc="outside upper center", ncols=11, columnspacing=0.9, handlelength=1.2)
    models_style.write_states(drawn, model_comparison, ranking, paper_names())
    return drawn


LOOKS = {
    "paper's recipe, Keras's default": {"color": drawing.BLACK},
    "paper's recipe, as worded": {"color": drawing.FAMILIES[1]},
    "our recipe": {"color": drawing.FAMILIES[0], "linestyle": "--"},
}


def figure_plateau(model_comparison: Any) -> Figure:
    """What the rule of the plateau does: one model by the paper's recipe, by its words, and by ours, if published.

    Keras's default counts a decrease of the validation error only if it is larger than 1e-4, which is soon more than
    the error is.

    Raises:
        FileNotFoundError: The model is not trained by the paper's recipe.
    """
    beside = model_comparison["beside"]
    if PAPER_TRAINED[REFERENCE] not in beside:
        raise FileNotFoundError(f"{PAPER_TRAINED[REFERENCE]} is not published; `make model-paper-recipe` trains it")
    found = (beside[PAPER_TRAINED[REFERENCE]], beside.get(WORDED), model_comparison["models"].get(REFERENCE))
    drawn, (errors, rates) = drawing.panels(1, 2, sharex=True, height=2.5)
    for (label, look), one in zip(LOOKS.items(), found, strict=True):
        if one:
            history = one["history"]
            errors.plot(history["epoch"], history["validation_mse"], linewidth=0.8, label=label, **look)
            rates.plot(history["epoch"], history["learning_rate"], linewidth=1.2, label=label, **look)
    errors.set(xlabel="epoch", ylabel="validation MSE", xscale="log", yscale="log")
    rates.set(xlabel="epoch", ylabel="learning rate", yscale="log", ylim=(5e-8, None))  # ours ends at zero
    drawing.log_labels(errors.xaxis)
    rates.legend(loc="lower left")
    return drawn


def draw_sizes(axes: Axes, content: Any, ranking: Any = None) -> None:
    """Number of parameters against DTW-RMSE, with the paper's reference model."""
    models = content["models"]
    paper = drawing.paper_values("reference_model")
    axes.plot(paper["parameters"] / 1e3, paper["dtw_rmse"], **models_style.paper_marker(paper["name"]))
    draw_models(axes, content, "parameters", "dtw_rmse", ranking, factor=1e-3)
    # The least error is named, and its marker is in front and smaller: a model of about the same size may lie on it.
    best = min(models, key=lambda name: models[name]["dtw_rmse"])
    of_seeds = models_style.seeds_of(ranking, best) >= models_style.SEVERAL
    error = ranking["spread"][best]["test_dtw_rmse"]["median"] if of_seeds else models[best]["dtw_rmse"]
    place = models[best]["parameters"] / 1e3, error
    axes.plot(*place, **models_style.marker(best) | {"markersize": 4.8}, zorder=3.5)
    color = models_style.color(best)
    leader = {"arrowstyle": "-", "linewidth": 0.5, "color": color, "shrinkB": 2}
    look = {"ha": "center", "va": "center", "color": color, "arrowprops": leader}
    drawing.note(axes, f"least error: {best}", place, (52, -9), **look)
    axes.set(xlabel="learnable parameters (thousands)", ylabel="held-out DTW-RMSE", yscale="log", xlim=(100, 720))
    axes.margins(y=0.2)
    drawing.log_labels(axes.yaxis)


def draw_effective_energy(axes: Axes, content: dict[str, Any]) -> None:
    """Theory as a line; solver and surrogate at the velocities of the table; the solver also at its own velocities."""
    points = content["points"]
    theirs, own = ([one[name] for one in points] for name in ("crack_velocity", "own_crack_velocity"))
    solver = [one["solver"] for one in points]
    theory = content["theory"]
    axes.plot(
        theory["crack_velocity"], theory["effective_energy"], color=COLOURS["closed form"], label="Persson-Brener"
    )
    axes.plot(theirs, solver, "s", color=drawing.BLACK, markersize=4.5, label="solver")
    open_square = {"color": drawing.BLACK, "markerfacecolor": "none", "markersize": 6.0, "markeredgewidth": 0.7}
    axes.plot(own, solver, "s", label="solver, own velocity", **open_square)
    name = content["config"]["model"]
    beyond = content["summary"]["extrapolation_percent"]
    axes.plot(theirs, [one["surrogate"] for one in points], label=name, **models_style.marker(name))
    if beyond:
        axes.set_title(rf"{name}: $\mu$ is {beyond:.3g} % above its training range", loc="right")
    axes.set(xscale="log", xlabel=r"crack velocity $\tilde v_c$", ylabel=r"effective energy $\hat\Gamma_\mathrm{eff}$")
    axes.set_ylim(0.0, None)
    axes.legend(loc="upper left")


def draw_data_efficiency(axes: Axes, content: dict[str, Any]) -> None:
    """Held-out MSE against the share of training trajectories: mean and standard deviation over the folds."""
    axes.set(xlabel="share of the training trajectories (%)", ylabel="held-out MSE", xscale="log", yscale="log")
    shares = sorted(content["shares"], key=lambda one: one["percent"])
    percents, means, deviations = ([one[name] for one in shares] for name in ("percent", "mse_mean", "mse_sd"))
    look = models_style.marker(content["config"]["architecture"])
    folds = " or ".join(map(str, sorted({len(one["folds"]) for one in shares})))
    axes.plot(percents, means, color=look["color"], linewidth=1.0, zorder=1)
    ends = ([max(mean + sign * sd, 0.1 * mean) for mean, sd in zip(means, deviations, strict=True)] for sign in (-1, 1))
    axes.fill_between(percents, *ends, color=look["color"], alpha=0.2, linewidth=0)
    axes.errorbar(percents, means, deviations, capsize=2, label=f"mean of {folds} folds", **look)
    whole = {"markerfacecolor": "white", "markeredgecolor": look["color"], "markeredgewidth": 0.9}
    axes.plot(100.0, content["full"]["mse"], label=f"all, {content['full']['epochs']} epochs", **look | whole)
    axes.legend(loc="upper right")
    for axis in (axes.xaxis, axes.yaxis):
        drawing.log_labels(axis)


def figure_5(model_comparison: Any, persson_brener: Any, data_efficiency: Any, ranking: Any = None) -> Figure:
    """Figure 5: validation curves, size against shape error, surface energy against crack velocity, data efficiency.

    The filled squares of panel (c) are at the crack velocities of the paper's table, the open ones at those that the
    solver measures at the retreating contact edge. The Tabor parameter lies slightly above the range on which the model
    was trained; the title of the panel states the distance.
    """
    drawn, panels = drawing.panels(2, 2, height=5.4)
    draw_curves(panels[0], model_comparison, "concat", ranking)
    panels[0].set_title("concatenated models", loc="right")
    draw_sizes(panels[1], model_comparison, ranking)
    draw_effective_energy(panels[2], persson_brener)
    draw_data_efficiency(panels[3], data_efficiency)
    handles = models_style.handles(drawing.paper_values("reference_model")["name"])
    drawn.legend(handles=handles, loc="outside upper center", ncols=11, columnspacing=1.0, handlelength=1.4)
    models_style.write_states(drawn, model_comparison, ranking, paper_names())
    return drawn


MEANS = {"mse": "MSE", "mae": "MAE", "dtw_rmse": "DTW-RMSE"}
MEDIANS = {"nmae": "NMAE", "pull_off_force": "Pull-off", "hysteresis": "Hysteresis"}
COLUMNS: dict[str, Callable[[dict[str, Any]], str]] = {
    "Model": lambda one: one["name"],
    "Parameters": lambda one: f"{one['parameters']:,}",
    "Sizes": lambda one: drawing.paper_values("structure")["sizes"].get(one["name"].split("-")[0], {}).get("how", "-"),
    **{head: lambda one, name=name: number(one[name]) for name, head in MEANS.items()},
    **{
        f"{head}, median (%)": lambda one, name=name: number(one["test"][f"{name}_percent"]["median"], 2)
        for name, head in MEDIANS.items()
    },
    "Recipe": lambda one: one["recipe"]["name"],
    "Trajectories": lambda one: f"{one['training_trajectories']:,}",
    "Epochs": lambda one: str(one["epochs"]),
    "Core seconds": lambda one: "on a GPU" if one["core_seconds"] is None else f"{one['core_seconds']:.0f}",
    "Batch (ms)": lambda one: one["batch"],
}
"""Column heads, and functions that write the cell of one model, named as it is published."""


def table_models(model_comparison: Any, training_speed: Any = None, model_forces: Any = None) -> Table:
    """Table: the trained models with their parameters, held-out errors, epochs and cost; missing models are named.

    A model that was also trained by the paper's recipe has two rows, of which this comes first. Models that were
    trained differently (more data, fewer epochs, other inputs) follow; their names state the difference.
    """
    ranking = model_comparison["comparison"]["ranking"]
    sizes = drawing.paper_values("structure")["sizes"]
    note = models_style.missing_note(model_comparison["missing"])
    words = " ".join(
        [
            caption("models", sizes="; ".join(f"{name} ({one['how']}), {one['what']}" for name, one in sizes.items())),
            *([f"{note[0].upper()}{note[1:]}."] if note else []),
            *model_comparison["outdated"].values(),
            models_style.forces_note(model_forces),
        ]
    )
    measured = training_speed["models"].items() if training_speed else ()
    batches = {name: number(1e3 * one["seconds_per_batch"]["median"], 2) for name, one in measured}
    theirs = (training_speed or {}).get("by_paper_recipe", {}).items()
    batches |= {PAPER_TRAINED[name]: number(1e3 * one["median"], 2) for name, one in theirs}
    by_recipe = models_style.trained_by_paper_recipe(model_comparison)
    shown = []
    for name in ranking:
        both = {PAPER_TRAINED[name]: by_recipe.get(name), name: model_comparison["models"][name]}
        shown += [one | {"name": label, "batch": batches.get(label, "-")} for label, one in both.items() if one]
    named = {one["name"] for one in shown}
    beside = model_comparison["beside"].items()
    shown += [one | {"name": name, "batch": "-"} for name, one in beside if name not in named]
    paper = drawing.paper_values("reference_model")
    errors = [number(paper[name]) for name in MEANS]
    errors += [number(paper[key], 2) if (key := f"{name}_percent") in paper else "-" for name in MEDIANS]
    stated = [f"{paper['name']}, paper", f"{paper['parameters']:,}", "-", *errors, *["-"] * 5]
    table = Table.of(COLUMNS, shown, words.strip())
    return replace(table, rows=[stated, *table.rows])
