"""The Newton iteration of a time step with contact, as :func:`stripfold.solve.newton.solve` does it."""

from __future__ import annotations

import numba
import numpy as np

from stripfold.kernels import band as bands
from stripfold.kernels import bending, elements
from stripfold.kernels.compiler import compiled, index, mask, vector

CONVERGED, NOT_FINITE, CYCLING, SINGULAR, TOO_MANY = range(5)
EPS = float(np.finfo(float).eps)
SINGLE = 8
"""Iteration from which only the worst contact changes."""
REUSED = 1e-2
"""Reduction of the largest unbalanced force by an iteration after which the next one uses the same factors."""
SLOW = 0.1
"""Reduction of that force that makes an iteration look for the rounding error."""
REPEATED = 1e-2
"""Relative change of the largest unbalanced force below which contacts that open and close in turn are cycling."""


@compiled(numba.void(mask, vector, vector, numba.boolean))
def next_active(active, force, gap, single):
    """Release active contacts with a tensile force and add those that penetrate, in place.

    Many changes at once can cycle: ``single`` is for the worst of either kind only.
    """
    worst_release = worst_add = -1
    for i in range(len(active)):
        if active[i] and force[i] < 0.0 and (worst_release < 0 or force[i] < force[worst_release]):
            worst_release = i
        if not active[i] and gap[i] < 0.0 and (worst_add < 0 or gap[i] < gap[worst_add]):
            worst_add = i
    for i in range(len(active)):
        if active[i]:
            if force[i] < 0.0 and (not single or i == worst_release):
                active[i] = False
        elif gap[i] < 0.0 and (not single or i == worst_add):
            active[i] = True


@compiled(numba.boolean(numba.boolean[:, ::1], vector, numba.int64))
def is_cycling(sets, worst, iteration):
    """Whether one or two contacts have opened and closed in turn four times with the same forces.

    This happens where no state exists, for example past a limit point.  ``sets``: which contacts were active in the
    last iterations, shape (4, n), that of the present one in row ``iteration % 4``; ``worst``: largest unbalanced force
    of each iteration.
    """
    if iteration < 3:
        return False
    changed = 0
    for i in range(sets.shape[1]):
        a, b = sets[(iteration - 3) % 4, i], sets[(iteration - 2) % 4, i]
        c, d = sets[(iteration - 1) % 4, i], sets[iteration % 4, i]
        if a != c or b != d:
            return False
        if a != b:
            changed += 1
    if changed == 0 or changed > 2:
        return False
    last, previous = worst[iteration], worst[iteration - 1]
    same = abs(last - worst[iteration - 2]) <= REPEATED * last
    return same and abs(previous - worst[iteration - 3]) <= REPEATED * previous


@compiled(
    numba.types.Tuple((numba.int64, vector))(
        elements.elements_type,
        bending.springs_type,
        vector,
        numba.int64,
        vector,
        vector,
        vector,
        vector,
        vector,
        index,
        vector,
        index,
        vector,
        mask,
        mask,
        vector,
        vector,
    )
)
def solve(
    el, springs, mass, width, weight, q0, v0, q, force,
    prescribed, given, bounded, lower, active, movable, step, options,
):  # fmt: skip
    """Solve a time step of the energy-momentum method.

    Parameters
    ----------
    el, springs, mass, width, weight
        The elements; friction in them, that of the end of the step; the mass matrix as :mod:`.band` stores it, its
        width, and the weight, shape (n,).
    q0, v0
        Start of the step, shape (n,).
    q, force
        Shape (n,): the guess, which becomes the solution; and the unbalanced force there, set.
    prescribed, given
        Unknowns with given values, and these.
    bounded, lower, active
        Unknowns with a lower bound, the bounds, and those on it: a guess, which is updated.
    movable
        Shape (n,): unknowns whose change in one iteration is limited.
    step
        Duration; factors of the mass for inertia and drag; viscosity over duration.
    options
        Tolerances of forces and gaps, largest change of an unknown, largest number of iterations.

    Returns ``status``, ``history``: what ended the iteration; the largest unbalanced force before each update and at
    the end.
    """
    n = len(q)
    dt, inertia, drag, kappa = step[0], step[1], step[2], step[3]
    force_tolerance, gap_tolerance, largest, max_iterations = options[0], options[1], options[2], int(options[3])
    flat, band = bands.storage(n, width)
    factors, none, nothing = np.empty(len(flat)), np.empty((0, 0)), np.empty(0)
    reach = np.empty(n, np.int64)
    held, fix, change, rounding = np.zeros(n, np.bool_), np.zeros(n), np.empty(n), np.zeros(n)
    sets = np.zeros((4, len(bounded)), np.bool_)
    worst = np.zeros(max_iterations)
    reaction, gap = np.empty(len(bounded)), np.empty(len(bounded))
    inertial, before = np.empty(n), np.empty(n)
    for i in range(n):
        before[i] = q0[i]
        change[i] = q[i] - q0[i]
    iteration, with_tangent, damping, biggest = 0, True, 1.0, 0.0
    while iteration < max_iterations:
        for i in range(n):
            moved = q[i] - q0[i]
            inertial[i] = inertia * (moved - dt * v0[i]) + drag * moved
        inertial = bands.product(mass, width, inertial)
        for i in range(n):
            force[i] = weight[i] + inertial[i]
        if with_tangent:
            for i in range(len(flat)):
                flat[i] = (inertia + drag) * mass[i]
        stress, target = (elements.predict(el, before, change, nothing), band) if with_tangent else (none, none)
        elements.assemble(el, q0, q, kappa, False, stress, force, target, width, none, none)
        if len(springs.slip) > 0:
            bending.add_springs(springs, q, none, force, target, width)
        if iteration == 0 or not with_tangent:
            for i in range(n):
                held[i] = False
                fix[i] = 0.0
            for i in range(len(prescribed)):
                held[prescribed[i]] = True
                fix[prescribed[i]] = given[i] - q[prescribed[i]]
            for i in range(len(bounded)):
                sets[iteration % 4, i] = active[i]
                if active[i]:
                    held[bounded[i]] = True
                    fix[bounded[i]] = lower[i] - q[bounded[i]]
            biggest = 0.0
            for i in range(n):
                if not held[i]:
                    if not np.isfinite(force[i]):
                        return NOT_FINITE, worst[: iteration + 1]
                    biggest = max(biggest, abs(force[i]))
            worst[iteration] = biggest
            if iteration > 0 and SLOW * worst[iteration - 1] < biggest < 1.0 and not rounding[0] > 0.0:
                # The rounding of q limits the residual: see `solve/newton.py`.
                for i in range(n):
                    inertial[i] = 4.0 * EPS * (abs(q[i]) + 1.0)
                rounding = bands.rounding(flat, width, inertial)
            converged = True
            for i in range(n):
                if not held[i] and abs(force[i]) > max(force_tolerance, rounding[i]):
                    converged = False
                if abs(fix[i]) > gap_tolerance:
                    converged = False
            for i in range(len(bounded)):
                if active[i]:
                    if force[bounded[i]] < -force_tolerance:
                        converged = False
                elif q[bounded[i]] - lower[i] < -gap_tolerance:
                    converged = False
            if converged:
                return CONVERGED, worst[: iteration + 1]
            if is_cycling(sets, worst, iteration):
                return CYCLING, worst[: iteration + 1]
        # After an update the force comes first: it may show convergence, or that the last factors will do once more.
        reuse = False
        if not with_tangent:
            reuse = damping == 1.0 and biggest <= REUSED * worst[iteration - 1]
            for i in range(len(bounded)):
                if active[i] != sets[(iteration - 1) % 4, i]:
                    reuse = False
            if not reuse:
                with_tangent = True
                continue
        if not reuse:
            for i in range(len(flat)):
                factors[i] = flat[i]
            bands.hold(factors, width, held)
            if not bands.factorise(factors, width, reach):
                return SINGULAR, worst[: iteration + 1]
        change = bands.product(flat, width, fix)
        for i in range(n):
            change[i] = 0.0 if held[i] else -(force[i] + change[i])
        change = bands.substitute(factors, width, reach, change)
        longest = 0.0
        for i in range(n):
            change[i] += fix[i]
            if movable[i]:
                longest = max(longest, abs(change[i]))
        for i in range(len(bounded)):
            # Of an active unknown the force that the bound will exert; others need none.
            row = bounded[i]
            reaction[i] = force[row]
            if active[i]:
                for j in range(max(0, row - width), min(n, row + width + 1)):
                    reaction[i] += band[j, width + row - j] * change[j]
        damping = min(1.0, largest / longest) if longest > 0.0 else 1.0
        for i in range(n):
            change[i] *= damping
        for i in range(n):
            before[i] = q[i]
            q[i] += change[i]
        for i in range(len(bounded)):
            gap[i] = q[bounded[i]] - lower[i]
        next_active(active, reaction, gap, iteration >= SINGLE)
        iteration, with_tangent = iteration + 1, False
    return TOO_MANY, worst
