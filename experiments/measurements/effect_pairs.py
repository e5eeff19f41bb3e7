"""What an effect costs that a scene does not have: every pair of scenes that differ in one effect alone.

Effects are adhesion, relaxation (none, one process, three), what moves the sphere (the stage itself, a spring, or a
prescribed force), and further cycles (ten instead of one, of elastic contacts). All scenes are pressed as deep, in
units of mu h0 (`experiments.measurements.effects`), at one speed; a prescribed force presses as hard as the stage
does, and pulls where there is adhesion. Each run has a peak of its own, so that no result is found ready; what a
process keeps between runs (the curve of elastic equilibria) is kept.
"""

from itertools import combinations, product
from typing import Any, NamedTuple

import numpy as np

from bem import Elastic, ForceProtocol, HardContact, LennardJones, PiecewiseLinearProtocol, Scene, simulate
from bem._support.wording import markdown_table
from bem.methods.closed_forms import hertz
from bem.problem.materials import Material
from experiments.cases import completed
from experiments.harness import Repeats, progress, timed
from experiments.measurements.effects import DEPTH, DWELL, RATE, SLS, START, THREE

TABORS = (0.3, 1.0, 3.0, 5.0, 8.0, 30.0, 300.0)
ENOUGH = 10.0  # seconds in all runs of a scene, beyond which it is not run again
SPRING, PULL, CYCLES = 2.0, 0.5, 10
MATERIALS: dict[int, Material] = {0: Elastic(), 1: SLS, 3: THREE}
DEVICES = ("stage", "spring", "force")
LARGEST = {"relaxation": 1.1, "adhesion": 0.5, "cycles": 2.0, "spring": 1.5, "force": 2.0}
"""Aims: the largest ratio of seconds, without relaxation or adhesion to with it, with one of the others to without."""
WORDS = {
    "relaxation": "without relaxation to with it",
    "adhesion": "without adhesion to with it",
    "cycles": f"{CYCLES} elastic cycles to one",
    "spring": "behind a spring to without",
    "force": "by force to by indentation",
}


class Effects(NamedTuple):
    """What one scene has."""

    adhesion: bool
    processes: int
    device: str = "stage"
    cycles: int = 1

    @property
    def name(self) -> str:
        """In words, as in the table and the figure."""
        labels = ["adhesion" if self.adhesion else "Hertz"]
        labels += {0: [], 1: ["one relaxation"], 3: ["three relaxations"]}[self.processes]
        labels += [] if self.device == "stage" else [self.device]
        return ", ".join(labels + ([f"{self.cycles} cycles"] if self.cycles > 1 else []))


EVERY = [Effects(*parts) for parts in product((False, True), MATERIALS, DEVICES)]
EVERY += [Effects(adhesion, 0, "stage", CYCLES) for adhesion in (False, True)]


def case(effects: Effects, tabor: float, peak: float) -> tuple[Scene, PiecewiseLinearProtocol | ForceProtocol]:
    """The scene of some effects, and the path to a peak (times the common one)."""
    law = LennardJones() if effects.adhesion else HardContact()
    scene = Scene(tabor, MATERIALS[effects.processes], law, SPRING if effects.device == "spring" else None)
    top, bottom = peak * DEPTH * tabor, START * tabor
    ramp = (top - bottom) / (RATE * tabor)
    times, depths = [0.0], [bottom]
    for _ in range(effects.cycles):
        times += [times[-1] + ramp, times[-1] + ramp + DWELL, times[-1] + 2.0 * ramp + DWELL]
        depths += [top, top, bottom]
    if effects.device == "force":
        press = float(hertz.force_from_indentation(np.array(top), tabor))
        return scene, ForceProtocol(times, [0.0, press, press, PULL if effects.adhesion else 0.0])
    return scene, PiecewiseLinearProtocol(times, depths)


def seconds(effects: Effects, tabor: float, repeats: int) -> float:
    """Median processor seconds of `simulate`, the call included, over runs of one peak each, `ENOUGH` seconds of them.

    Raises:
        RuntimeError: A simulation did not complete.
    """
    spent: list[float] = []
    for peak in np.linspace(0.9, 1.1, repeats):
        if sum(spent) > ENOUGH:
            break
        completed(simulate(*case(effects, tabor, float(peak))), effects.name)
        nearby = case(effects, tabor, float(peak) * 1.001)
        spent += timed(lambda nearby=nearby: simulate(*nearby), first=False)
    return float(np.median(spent))


def pairs() -> list[tuple[str, Effects, Effects]]:
    """The effect, the scene that costs no more by the aim, and the one it is compared with."""
    comparisons = []
    for first, second in combinations(EVERY, 2):
        differ = [name for name in Effects._fields if getattr(first, name) != getattr(second, name)]
        less, more = sorted((first, second), key=lambda e: (e.adhesion, e.processes, DEVICES.index(e.device), e.cycles))
        if differ in (["adhesion"], ["processes"]):
            comparisons.append(({"processes": "relaxation"}.get(differ[0], differ[0]), less, more))
        elif differ == ["cycles"] or (differ == ["device"] and less.device == "stage"):
            comparisons.append((more.device if differ == ["device"] else "cycles", more, less))
    return comparisons


def page_text(effect_pairs: Any) -> str:
    """The pairs as a table, one row an effect, for docs/effects.md."""
    table = []
    for effect, text in WORDS.items():
        ratios = np.array([row["ratios"] for row in effect_pairs["pairs"] if row["effect"] == effect])
        over = int(np.sum(ratios > LARGEST[effect]))
        numbers = (f"{np.median(ratios):.2f}", f"{ratios.max():.2f}", f"{LARGEST[effect]:g}", str(over))
        table.append([text, str(ratios.size), *numbers])
    header = ["Ratio of processor times", "Pairs", "Median", "Largest", "Aim", "Over the aim"]
    source = f"Measured by `{effect_pairs['command']}` on {effect_pairs['host']}."
    return f"{markdown_table(header, table, 'lrrrrr')}\n\n{source}"


def study(*, repeats: Repeats = 21) -> dict[str, Any]:
    """Measure every scene, and compare those that differ in one effect."""
    spent = {effects: [seconds(effects, tabor, repeats) for tabor in TABORS] for effects in progress(EVERY, "scenes")}
    rows = []
    for effect, scene, base in pairs():
        ratios = [a / b for a, b in zip(spent[scene], spent[base], strict=True)]
        rows.append({"effect": effect, "scene": scene.name, "to": base.name, "ratios": ratios, "aim": LARGEST[effect]})
    scenes = [{"name": effects.name, "seconds": times} for effects, times in spent.items()]
    return {"tabor": TABORS, "scenes": scenes, "pairs": rows}
