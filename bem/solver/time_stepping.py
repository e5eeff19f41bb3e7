"""Marching through a protocol: predict, solve, judge, accept; follow the edge with the mesh; jump where a branch ends.

Each step solves one equilibrium at the new indentation with the remembered traction of the old ones. Its length follows
from the difference of prediction and solution. A step that fails at the smallest useful length stands at a fold: the
contact then settles on the next stable branch, and the trajectory records the jump. Times inside are counted from the
start of each protocol segment, so that long dwells cost no digits.
"""

import numpy as np

from bem._support.jit import kernel
from bem._support.linear_algebra import copy_into
from bem.solver.discretisation.cohesive_zone import edge_width
from bem.solver.discretisation.mesh import Mesh, prolong
from bem.solver.discretisation.transfer import transfer
from bem.solver.energy import stored_energy
from bem.solver.equilibrium import force_of, new_factor, solve_adhesive
from bem.solver.extrapolation import expected_force, history_error, predict, prediction_error, push_recent, start_recent
from bem.solver.hereditary import (
    advance,
    forget_rate,
    new_memory,
    remembered_traction,
    shortest_relaxation,
    step_factors,
)
from bem.solver.instabilities import is_unstable, smallest_eigenvalue
from bem.solver.nonadhesive import solve_hard
from bem.solver.state import (
    FOLD_SOLVES,
    ITERATIONS,
    NODES,
    REJECTIONS,
    REMESHINGS,
    STEPS,
    UNSTABLE,
    Problem,
    edge_left_window,
    edge_of,
    equilibrate,
    first_mesh,
    force_on,
    right_side,
    select_mesh,
)

COMPLETED, NO_EQUILIBRIUM, TOO_MANY_STEPS, UNPHYSICAL = 0, 1, 2, 3

_STALE_AFTER = 8  # iterations in one step after which the kept factorisation is dropped
_CHECK_MESH_EVERY = 40  # steps
_STIFF_RESPONSE = 0.02
_BEND = 0.05  # change of the force's course in one step, over the force, from which its history is looked at
_JUMP_IN_FORCE, _JUMP_IN_WIDTHS = 0.02, 0.3


@kernel
def _enter(table: np.ndarray, row: int, values: tuple) -> None:
    for k in range(table.shape[1]):
        table[row, k] = values[k]


@kernel
def _longer(table: np.ndarray) -> np.ndarray:
    """The same rows in a table of twice the length."""
    longer = np.empty((2 * table.shape[0], table.shape[1]))
    for row in range(table.shape[0]):
        copy_into(longer[row], table[row])
    return longer


@kernel
def _same_nodes(one: Mesh, other: Mesh) -> bool:
    if one.nodes.size != other.nodes.size:
        return False
    different = 0
    for j in range(one.nodes.size):
        different += one.nodes[j] != other.nodes[j]
    return different == 0


@kernel
def march(problem: Problem, mesh: Mesh, times: np.ndarray, depths: np.ndarray, glassy: bool, most_steps: int) -> tuple:
    """Follow the indentation history (`times`, `depths`), linear between its s instants.

    Args:
        mesh: the user's own; otherwise ignored.
        glassy: whether the surfaces meet at once (instantaneous modulus) rather than fully relaxed.
        most_steps: give up after this many.

    Returns:
        records (steps, 4): time, indentation, force, contact radius; jumps (j, 7): time, indentation, force before and
        after, smallest eigenvalue before and after, energy lost (elastic contacts only, else NaN); counts (9,) as named
        in `COUNTS`; steps of each segment (s - 1,); stored energy at the beginning and at the end (2,); outcome.
    """
    controls = problem.controls
    tabor, hard = problem.tabor, problem.hard
    remembers = problem.strengths.size > 0
    glassy_response = 1.0 - np.sum(problem.strengths)
    relaxation = shortest_relaxation(problem.strengths, problem.times)
    counts = np.zeros(9, dtype=np.int64)
    segment_steps = np.zeros(times.size - 1, dtype=np.int64)
    records, jumps = np.empty((256, 4)), np.empty((16, 7))
    recorded, jumped = 0, 0
    energies = np.zeros(2)

    memory = new_memory(problem.strengths, problem.times, problem.grid.size)
    on_grid = np.empty(memory.traction.shape[1])
    depth = depths[0]
    if not problem.fixed_mesh:
        mesh = first_mesh(problem)
    gap, tractions = np.empty(mesh.radii.size), np.zeros(mesh.radii.size)
    for i in range(gap.size):
        gap[i] = max(1.0 - depth + 0.5 * tabor * mesh.radii[i] ** 2, 1.0 if hard else 0.95)
    mesh, gap, tractions, solved = equilibrate(
        problem,
        mesh,
        depth,
        np.zeros(memory.traction.shape[1]),
        glassy_response if glassy else 1.0,
        gap,
        tractions,
        counts,
    )
    force, edge = force_on(hard, mesh.force_weights, gap, tractions), edge_of(hard, mesh.radii, gap, tractions)
    if not solved:
        return records[:0], jumps[:0], counts, segment_steps, energies, NO_EQUILIBRIUM
    if remembers:
        prolong(mesh, tractions, memory.traction[0])
        if glassy:
            for i in range(problem.strengths.size):
                copy_into(memory.vectors[0, i], memory.traction[0])
    _enter(records, 0, (times[0], depth, force, edge))
    recorded = 1
    factor = new_factor(gap.size)
    energies[0] = stored_energy(mesh.radii, mesh.force_weights, tabor, hard, depth, gap, tractions)
    direction = 1.0
    since_choice = 0

    for segment in range(times.size - 1):
        duration = times[segment + 1] - times[segment]
        rate = (depths[segment + 1] - depths[segment]) / duration
        speed = abs(rate)
        recent = start_recent(gap, tractions, 0.0, force)
        forget_rate(memory)
        longest = controls.longest_step * duration
        if speed == 0.0 and not remembers:
            longest = duration  # nothing happens
        # Below this a step changes neither indentation nor memory enough to matter: failure there is a fold.
        smallest = 1e-3 * relaxation
        first = 1e-2 * relaxation
        if speed > 0.0:
            # a stiff glass lets go over a shorter way
            smallest = min(smallest, controls.fold_increment * 2.0 / (problem.force_weight * speed))
            first = min(first, 0.02 / speed)
        smallest = min(max(smallest, 1e-13 * duration), longest)
        step = max(min(first, longest), smallest)
        now = 0.0
        while now < duration:
            if recorded >= most_steps:
                return records[:recorded], jumps[:jumped], counts, segment_steps, energies, TOO_MANY_STEPS
            if now + 1.0000001 * step >= duration:
                step, after = duration - now, duration
            else:
                if now + 2.0 * step > duration:
                    step = 0.5 * (duration - now)
                after = now + step
            new_depth = depths[segment + 1] if after == duration else depths[segment] + rate * after
            factors = step_factors(memory, step, recent.count[0] >= 2)
            remembered = remembered_traction(memory, factors)
            rhs = right_side(tabor, mesh.radii, mesh.master_rows, new_depth, remembered)
            guess_gap, guess_traction = np.empty(gap.size), np.empty(gap.size)
            predict(recent, after, tabor, hard, guess_gap, guess_traction)
            new_gap, new_traction = guess_gap.copy(), guess_traction.copy()
            before = counts[ITERATIONS]
            # a stiff response turns a small residual into a large traction
            tolerance = controls.residual * min(1.0, 10.0 * factors.response)
            force_error = problem.force_error * max(abs(force), problem.force_scale)
            if hard:
                solved = solve_hard(mesh.influence, rhs, factors.response, new_gap, new_traction, counts)
            else:
                solved = solve_adhesive(
                    mesh.influence,
                    mesh.force_weights,
                    tabor,
                    rhs,
                    factors.response,
                    tolerance,
                    force_error,
                    factor,
                    new_gap,
                    new_traction,
                    counts,
                )
                if not solved or counts[ITERATIONS] - before >= _STALE_AFTER:
                    factor.order[0] = 0
            shrink = 0.25
            order = recent.count[0]
            if solved:
                error = prediction_error(
                    mesh.force_weights,
                    tabor,
                    hard,
                    guess_gap,
                    guess_traction,
                    new_gap,
                    new_traction,
                    problem.force_scale,
                    problem.force_weight,
                    problem.local_weight,
                    np.nan if remembers or hard else expected_force(recent, after),
                )
                shrink = 0.9 * (controls.prediction / max(error, 1e-12)) ** (1.0 / order)
                if error > 2.0 * controls.prediction and step > 1.01 * smallest:
                    solved = False
                    shrink = max(0.2, min(0.8, shrink))
                elif order >= 2 and not hard and step > 1.01 * smallest:
                    forces = (force, records[recorded - 2, 2], force_of(mesh.force_weights, new_traction, new_gap))
                    bend = forces[2] - force - (force - forces[1]) / (recent.time[0] - recent.time[1]) * step
                    if abs(bend) > _BEND * max(abs(forces[2]), problem.force_scale):
                        error = history_error(
                            recent,
                            mesh.force_weights,
                            tabor,
                            hard,
                            after,
                            forces,
                            problem.force_scale,
                            problem.force_weight,
                        )
                        if error > 0.5 * controls.prediction:
                            solved, shrink = False, 0.5

            if not solved and step > 1.01 * smallest:
                counts[REJECTIONS] += 1
                step = max(shrink * step, smallest)
                continue

            jump = False
            eigenvalue = 0.0
            old_force, old_edge, held, lost = force, edge, mesh, np.nan
            if not solved:
                counts[FOLD_SOLVES] += 1
                forget_rate(memory)
                factors = step_factors(memory, step, recent.count[0] >= 2)
                remembered = remembered_traction(memory, factors)
                if not hard:
                    eigenvalue = smallest_eigenvalue(mesh.influence, tabor, factors.response, gap)
                if not remembers:
                    lost = stored_energy(mesh.radii, mesh.force_weights, tabor, hard, depth, gap, tractions) - force * (
                        new_depth - depth
                    )
                mesh, new_gap, new_traction, solved = equilibrate(
                    problem, mesh, new_depth, remembered, factors.response, gap.copy(), tractions.copy(), counts
                )
                if not solved:
                    return records[:recorded], jumps[:jumped], counts, segment_steps, energies, NO_EQUILIBRIUM
                if not remembers:
                    lost -= stored_energy(mesh.radii, mesh.force_weights, tabor, hard, new_depth, new_gap, new_traction)
                new_force, new_edge = (
                    force_on(hard, mesh.force_weights, new_gap, new_traction),
                    edge_of(hard, mesh.radii, new_gap, new_traction),
                )
                jump = abs(new_force - force) > _JUMP_IN_FORCE * max(abs(force), problem.force_scale)
                jump = jump or abs(new_edge - edge) > _JUMP_IN_WIDTHS * edge_width(edge, tabor, hard)
                # Another branch, or other nodes: what came before is no guide to what comes next.
                order = 0 if jump or not _same_nodes(mesh, held) else order
                factor = new_factor(new_gap.size)
                shrink = 1.0

            gap, tractions = new_gap, new_traction
            force, edge = force_on(hard, mesh.force_weights, gap, tractions), edge_of(hard, mesh.radii, gap, tractions)
            if not force >= problem.least_force:
                return records[:recorded], jumps[:jumped], counts, segment_steps, energies, UNPHYSICAL
            if remembers:
                prolong(mesh, tractions, on_grid)
                advance(memory, factors, step, on_grid)
            now, depth = after, new_depth
            if recorded + 2 > records.shape[0]:
                records = _longer(records)
            instant = times[segment + 1] if after == duration else times[segment] + now
            if jump:
                _enter(records, recorded, (instant, depth, old_force, old_edge))
                recorded += 1
                if jumped == jumps.shape[0]:
                    jumps = _longer(jumps)
                stiffness = smallest_eigenvalue(mesh.influence, tabor, factors.response, gap)
                _enter(jumps, jumped, (instant, depth, old_force, force, eigenvalue, stiffness, lost))
                jumped += 1
            _enter(records, recorded, (instant, depth, force, edge))
            recorded += 1
            segment_steps[segment] += 1
            counts[STEPS] += 1
            counts[NODES] += gap.size
            if problem.audit and not hard and is_unstable(mesh.influence, tabor, factors.response, gap):
                counts[UNSTABLE] += 1
            if order == 0:
                recent = start_recent(gap, tractions, now, force)
                forget_rate(memory)
                step = 2.0 * smallest
            else:
                push_recent(recent, gap, tractions, now, force)
                step = min(max(step * min(max(shrink, 0.3), 2.5), smallest), longest)

            since_choice += 1
            # In a glass that is stiff against what it remembers a new selection of nodes stirs up large tractions.
            routine = since_choice >= _CHECK_MESH_EVERY and factors.response > _STIFF_RESPONSE
            if edge_left_window(mesh.window, edge) or (routine and not problem.fixed_mesh):
                direction = 1.0 if edge >= old_edge else -1.0
                since_choice = 0
                new = select_mesh(problem, mesh, edge, direction, remembered, factors.response, gap, tractions)
                if not _same_nodes(new, mesh):
                    moved = start_recent(np.zeros(new.radii.size), np.zeros(new.radii.size), 0.0, 0.0)
                    for k in range(recent.count[0]):
                        transfer(
                            mesh, recent.gap[k], recent.traction[k], new, tabor, hard, moved.gap[k], moved.traction[k]
                        )
                        moved.time[k], moved.force[k] = recent.time[k], recent.force[k]
                    moved.count[0] = recent.count[0]
                    recent, mesh = moved, new
                    gap, tractions = recent.gap[0].copy(), recent.traction[0].copy()
                    factor = new_factor(gap.size)
                    counts[REMESHINGS] += 1
    energies[1] = stored_energy(mesh.radii, mesh.force_weights, tabor, hard, depth, gap, tractions)
    return records[:recorded], jumps[:jumped], counts, segment_steps, energies, COMPLETED
