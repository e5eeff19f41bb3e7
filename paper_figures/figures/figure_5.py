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


def draw_sizes(axes: Axes, comparison: Any, ranking: Any = None) -> None:
    """Number of parameters against DTW-RMSE, with the paper's reference model."""
    models = comparison["models"]
    paper = drawing.paper_values("reference_model")
    axes.plot(paper["parameters"] / 1e3, paper["dtw_rmse"], **models_style.paper_marker(paper["name"]))
    draw_models(axes, comparison, "parameters", "dtw_rmse", ranking, factor=1e-3)
    # The least error is named, and its marker is in front and smaller: a model of about the same size may lie on it.
    best = min(models, key=lambda name: models[name]["dtw_rmse"])
    of_seeds = models_style.seeds_of(ranking, best) >= models_style.SEVERAL
    error = ranking["spread"][best]["test_dtw_rmse"]["median"] if of_seeds else models[best]["dtw_rmse"]
    position = models[best]["parameters"] / 1e3, error
    axes.plot(*position, **models_style.marker(best) | {"markersize": 4.8}, zorder=3.5)
    color = models_style.color(best)
    leader = {"arrowstyle": "-", "linewidth": 0.5, "color": color, "shrinkB": 2}
    look = {"ha": "center", "va": "center", "color": color, "arrowprops": leader}
    drawing.note(axes, f"least by ours: {best}", position, (46, -9), **look)
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
    axes.plot(theirs, [point["surrogate"] for point in points], label=name, **models_style.marker(name))
    if beyond:
        axes.set_title(rf"{name}: $\mu$ is {beyond:.3g} % above its training range", loc="right")
    axes.set(xscale="log", xlabel=r"crack velocity $\tilde v_c$", ylabel=r"effective energy $\hat\Gamma_\mathrm{eff}$")
    axes.set_ylim(0.0, None)
    axes.legend(loc="upper left")


def draw_data_efficiency(axes: Axes, efficiency: dict[str, Any]) -> None:
    """Held-out MSE against the share of training trajectories: mean and standard deviation over the folds."""
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
    axes.legend(loc="upper right")
    for axis in (axes.xaxis, axes.yaxis):
        drawing.log_labels(axis)


def compose(model_comparison: Any, persson_brener: Any, data_efficiency: Any, ranking: Any = None) -> Figure:
    """Draw figure 5; (a) and (b) show the spread over seeds of `ranking`."""
    drawn, panels = drawing.panels(2, 2, height=5.4)
    draw_curves(panels[0], model_comparison, "concat", ranking)
    panels[0].set_title("concatenated models", loc="right")
    draw_sizes(panels[1], model_comparison, ranking)
    draw_effective_energy(panels[2], persson_brener)
    draw_data_efficiency(panels[3], data_efficiency)
    drawn.legend(
        handles=models_style.handles(), loc="outside upper center", ncols=11, columnspacing=1.0, handlelength=1.4
    )
    models_style.write_states(drawn, model_comparison, ranking, paper_names())
    return drawn
