"""Figure 5: validation curves, size against shape error, surface energy against crack velocity, data efficiency.

The filled squares of panel (c) are at the crack velocities of the paper's table, the open ones at those that the solver
measures at the retreating contact edge. The Tabor parameter lies slightly above the range on which the model was
trained; the title of the panel states the distance.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bem.results.plots import COLOURS
from paper_figures.models.figure_learning_curves import draw_curves
from paper_figures.models.figure_mse_mae import draw_models
from paper_figures.style import drawing, models_style
from surrogate.architectures.naming import paper_names


def draw_sizes(axes: Axes, models: dict[str, Any]) -> None:
    """Number of parameters against DTW-RMSE, with the paper's reference model."""
    paper = drawing.paper_values("reference_model")
    axes.plot(paper["parameters"] / 1e3, paper["dtw_rmse"], **models_style.paper_marker(paper["name"]))
    draw_models(axes, models, "parameters", "dtw_rmse", factor=1e-3)
    best = min(models, key=lambda name: models[name]["dtw_rmse"])
    position, color = (models[best]["parameters"] / 1e3, models[best]["dtw_rmse"]), models_style.color(best)
    leader = {"arrowstyle": "-", "linewidth": 0.5, "color": color, "shrinkB": 2}
    drawing.note(axes, f"least: {best}", position, (46, -9), ha="center", va="center", color=color, arrowprops=leader)
    axes.set(xlabel="learnable parameters (thousands)", ylabel="held-out DTW-RMSE", yscale="log", xlim=(100, 720))
    axes.margins(y=0.2)
    drawing.log_labels(axes.yaxis)


def draw_effective_energy(axes: Axes, cracks: dict[str, Any]) -> None:
    """Theory as a line; solver and surrogate at the velocities of the table; the solver also at its own velocities."""
    points = cracks["points"]
    theirs, own = ([point[name] for point in points] for name in ("crack_velocity", "own_crack_velocity"))
    solver = [point["solver"] for point in points]
    theory = cracks["theory"]
    axes.plot(
        theory["crack_velocity"], theory["effective_energy"], color=COLOURS["closed form"], label="Persson-Brener"
    )
    axes.plot(theirs, solver, "s", color=drawing.BLACK, markersize=4.5, label="solver")
    open_square = {"color": drawing.BLACK, "markerfacecolor": "none", "markersize": 6.0, "markeredgewidth": 0.7}
    axes.plot(own, solver, "s", label="solver, own velocity", **open_square)
    name = cracks["config"]["model"]
    beyond = cracks["summary"]["extrapolation_percent"]
    for recipe, edge in (
        ("swift", {"markerfacecolor": "none", "markeredgecolor": models_style.color(name)}),
        ("paper", {}),
    ):
        if recipe in points[0]:
            look = models_style.marker(name) | edge
            axes.plot(theirs, [point[recipe] for point in points], label=models_style.label(name, recipe), **look)
    if beyond:
        axes.set_title(rf"{name}: $\mu$ is {beyond:.3g} % above its training range", loc="right")
    axes.set(xscale="log", xlabel=r"crack velocity $\tilde v_c$", ylabel=r"effective energy $\hat\Gamma_\mathrm{eff}$")
    axes.set_ylim(0.0, None)
    axes.legend(loc="upper left")


def draw_data_efficiency(axes: Axes, efficiency: dict[str, Any], reference: dict[str, Any] | None) -> None:
    """Held-out MSE against the share of training trajectories, by `swift`: mean and standard deviation over the folds.

    `reference` is the training of all by the paper's recipe, or `None`.
    """
    axes.set(xlabel="share of the training trajectories (%)", ylabel="held-out MSE", xscale="log", yscale="log")
    shares = sorted(efficiency["shares"], key=lambda share: share["percent"])
    percents, means, deviations = ([share[name] for share in shares] for name in ("percent", "mse_mean", "mse_sd"))
    look = models_style.marker(efficiency["config"]["architecture"])
    folds = " or ".join(map(str, sorted({len(share["folds"]) for share in shares})))
    axes.plot(percents, means, color=look["color"], linewidth=1.0, zorder=1)
    ends = ([max(mean + sign * sd, 0.1 * mean) for mean, sd in zip(means, deviations, strict=True)] for sign in (-1, 1))
    axes.fill_between(percents, *ends, color=look["color"], alpha=0.2, linewidth=0)
    axes.errorbar(percents, means, deviations, capsize=2, label=f"mean of {folds} folds", **look)
    hollow = {"markerfacecolor": "white", "markeredgecolor": look["color"], "markeredgewidth": 0.9}
    axes.plot(100.0, efficiency["full"]["mse"], label=f"all, {efficiency['full']['epochs']} epochs", **look | hollow)
    if reference:
        label = f"all, paper’s recipe, {reference['epochs']} epochs"
        axes.plot(100.0, reference["mse"], label=label, **look | {"markeredgecolor": drawing.BLACK})
    axes.set_title(models_style.label(efficiency["config"]["architecture"], "swift"), loc="right")
    axes.legend(loc="upper right")
    for axis in (axes.xaxis, axes.yaxis):
        drawing.log_labels(axis)


def compose(model_comparison: Any, persson_brener: Any, data_efficiency: Any, ranking: Any = None) -> Figure:
    """Draw figure 5; where no model is trained by the paper's recipe, (a) shows the seeds of `ranking`."""
    recipe, models = models_style.leading(model_comparison)
    drawn = drawing.figure(height=6.0)
    grid = drawn.add_gridspec(2, 2)
    curves = grid[0, 0].subgridspec(2, 3).subplots(sharex=True, sharey=True)
    draw_curves(curves.ravel(), model_comparison, "concat", recipe, ranking)
    curves[1, 1].set_xlabel("epoch")
    for axes in curves[:, 0]:
        axes.set_ylabel(f"{models_style.label('concat', recipe)}\nvalidation MSE")
    panels = [curves[0, 0], *(drawn.add_subplot(place) for place in (grid[0, 1], grid[1, 0], grid[1, 1]))]
    drawing.letters(panels)
    draw_sizes(panels[1], models)
    panels[1].set_title("paper’s recipe" if recipe == "paper" else "swift", loc="right")
    draw_effective_energy(panels[2], persson_brener)
    reference = models_style.trained_by_paper_recipe(model_comparison).get(data_efficiency["config"]["architecture"])
    draw_data_efficiency(panels[3], data_efficiency, reference)
    drawn.legend(
        handles=models_style.handles(), loc="outside upper center", ncols=11, columnspacing=1.0, handlelength=1.4
    )
    models_style.write_states(drawn, model_comparison, None if recipe == "paper" else ranking, paper_names())
    return drawn
