"""The Newton iteration of a time step with contact, as :func:`stripfold.solve.newton.solve` does it."""

from __future__ import annotations

import numba
import numpy as np

from stripfold.kernels import band as bands
from stripfold.kernels import elements
from stripfold.kernels.compiler import compiled, index, mask, matrix, vector

CONVERGED, NOT_FINITE, CYCLING, SINGULAR, TOO_MANY = range(5)
EPS = float(np.finfo(float).eps)
SINGLE = 8
"""Iteration from which only the worst contact changes."""
REPEATED = 1e-2
"""Relative change of the largest unbalanced force below which contacts that open and close in turn are cycling."""


@compiled()
def _next_active(active, force, gap, single):
    """Release active contacts with a tensile force and add those that penetrate, in place."""
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


@compiled()
def _is_cycling(sets, worst, iteration):
    """Whether one or two contacts have opened and closed in turn four times with the same forces."""
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
        matrix,
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
def solve(el, mass, width, weight, q0, v0, q, force, prescribed, given, bounded, lower, active, movable, step, options):
    """Solve a time step of the energy-momentum method.

    Parameters
    ----------
    el, mass, width, weight
        The elements; the mass matrix as a band with ``top = 2 width``, the width, and the weight, shape (n,).
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

    Returns
    -------
    status, history
        What ended the iteration; the largest unbalanced force before each update and at the end.
    """
    n, height = len(q), 2 * width + 1
    dt, inertia, drag, kappa = step[0], step[1], step[2], step[3]
    force_tolerance, gap_tolerance, largest, max_iterations = options[0], options[1], options[2], int(options[3])
    band, factors, none = np.empty((n, height)), np.empty((n, height)), np.empty((0, 0))
    reach = np.empty(n, np.int64)
    held, fix, change, rounding = np.zeros(n, np.bool_), np.zeros(n), np.empty(n), np.zeros(n)
    sets = np.zeros((4, len(bounded)), np.bool_)
    worst = np.zeros(max_iterations)
    reaction, gap = np.empty(len(bounded)), np.empty(len(bounded))
    for i in range(n):
        change[i] = q[i] - q0[i]
    predicted = elements.predict(el, q0, change)
    iteration, with_tangent = 0, True
    while iteration < max_iterations:
        for i in range(n):
            moved = q[i] - q0[i]
            change[i] = inertia * (moved - dt * v0[i]) + drag * moved
        inertial = bands.product(mass, 2 * width, width, change)
        for i in range(n):
            force[i] = weight[i] + inertial[i]
        if with_tangent:
            for j in range(n):
                for i in range(height):
                    band[j, i] = (inertia + drag) * mass[j, width + i]
        stress, target = (predicted, band) if with_tangent else (none, none)
        elements.assemble(el, q0, q, kappa, False, stress, force, target, width)
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
            biggest, converged = 0.0, True
            for i in range(n):
                if not held[i]:
                    if not np.isfinite(force[i]):
                        return NOT_FINITE, worst[: iteration + 1]
                    biggest = max(biggest, abs(force[i]))
                    # The rounding of q limits the residual: see `solve/newton.py`.
                    if abs(force[i]) > max(force_tolerance, rounding[i]):
                        converged = False
                if abs(fix[i]) > gap_tolerance:
                    converged = False
            worst[iteration] = biggest
            for i in range(len(bounded)):
                if active[i]:
                    if force[bounded[i]] < -force_tolerance:
                        converged = False
                elif q[bounded[i]] - lower[i] < -gap_tolerance:
                    converged = False
            if converged:
                return CONVERGED, worst[: iteration + 1]
            if _is_cycling(sets, worst, iteration):
                return CYCLING, worst[: iteration + 1]
        if not with_tangent:
            # After an update the force comes first: most often it shows convergence.
            with_tangent = True
            continue
        if iteration == 0:
            for i in range(n):
                change[i] = 4.0 * EPS * (abs(q[i]) + 1.0)
            rounding = bands.product_of_magnitudes(band, width, width, change)
        change = bands.product(band, width, width, fix)
        for i in range(n):
            change[i] = 0.0 if held[i] else -(force[i] + change[i])
        for j in range(n):
            for i in range(height):
                factors[j, i] = band[j, i]
        bands.hold(factors, width, width, held)
        if not bands.factorise(factors, width, width, reach):
            return SINGULAR, worst[: iteration + 1]
        bands.substitute(factors, width, width, reach, change)
        longest = 0.0
        for i in range(n):
            change[i] += fix[i]
            if movable[i]:
                longest = max(longest, abs(change[i]))
        added = bands.product(band, width, width, change)
        damping = min(1.0, largest / longest) if longest > 0.0 else 1.0
        for i in range(n):
            change[i] *= damping
        predicted = elements.predict(el, q, change)
        for i in range(n):
            q[i] += change[i]
        for i in range(len(bounded)):
            reaction[i] = force[bounded[i]] + added[bounded[i]]
            gap[i] = q[bounded[i]] - lower[i]
        _next_active(active, reaction, gap, iteration >= SINGLE)
        iteration, with_tangent = iteration + 1, False
    return TOO_MANY, worst
