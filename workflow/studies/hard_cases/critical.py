"""Hard cases at and near critical points: cusp, symmetry, nearly singular tangents, repeated eigenvalues."""

from __future__ import annotations

from dataclasses import replace
from math import log, nan, pi

import numpy as np
from scipy.optimize import brentq

from stripfold import elastica
from stripfold.errors import NewtonError, SolveError
from stripfold.models.rod import Rod
from stripfold.solve import continuation, critical, newton
from stripfold.solve.linear import Band, solve_bordered
from stripfold.solve.problem import Tangent
from stripfold.solve.stability import nearest_eigenvalues
from studies.hard_cases.arch import LENGTH, NEWTON, NONE, STEPS, THICKNESS, Arch, Pushed, fold_load, sway_load
from studies.hard_cases.case import Case, Finding
from studies.modes import HeldStrip

CUSP, NEARBY_NEWTON, EXACT = "cusp", "neighbourhood of a critical point", "exact symmetry"
SINGULAR, REPEATED = "nearly singular K", "repeated eigenvalues"


def _height_at(r: float) -> Finding:
    """Followed from one side to the other through the cusp's neighbourhood: no fold may be found there."""
    arch, target = Arch.of(r), THICKNESS
    truth = brentq(lambda w: (1.0 - r) * w + 3.0 * w**3 / THICKNESS**2 - target, 0.0, 2.0 * THICKNESS, xtol=1e-14)
    points = arch.points(-target, target)
    count = sum(len(p.state.residuals) - 1 for p in points)
    if points[-1].lam <= target:
        return Finding(nan, truth, 0.0, count)
    state = newton.solve(arch.problem, points[-1].q, target, NONE, options=NEWTON)
    return Finding(-arch.height(state.q) / THICKNESS, truth / THICKNESS, 1e-3, count)


def _fold(r: float) -> Finding:
    found, count = Arch.of(r).critical()
    return Finding(found.lam / THICKNESS, fold_load(r) / THICKNESS, 5e-3 * fold_load(r) / THICKNESS, count)


def _folds_meet(_: float) -> Finding:
    """How the fold's load vanishes towards the cusp."""
    (far, one), (near, other) = Arch.of(1.4).critical(), Arch.of(1.1).critical()
    return Finding(log(far.lam / near.lam) / log(4.0), 1.5, 0.01, one + other)


def _both_sides(_: float) -> Finding:
    """Pressed down from its upper side and up from its lower one."""
    arch = Arch.of(2.0)
    z = np.zeros(arch.q.size, bool)
    z[1::4] = z[3::4] = True
    mirrored = Arch(replace(arch.problem, load=-arch.problem.load), np.where(z, -arch.q, arch.q))
    (up, one), (down, other) = arch.critical(), mirrored.critical()
    return Finding(down.lam / up.lam, 1.0, 1e-6, one + other)


def _sway(_: float) -> Finding:
    r = 8.0
    found, count = Arch.of(r).critical()
    return Finding(found.lam / THICKNESS, sway_load(r) / THICKNESS, 5e-3 * sway_load(r) / THICKNESS, count)


def _fold_and_sway_at_once(_: float) -> Finding:
    return _fold(5.5)


def _column(_: float) -> Finding:
    """A perfectly straight column stays straight beyond its buckling: only the eigenvalue tells."""
    model = Rod.of(1.0, 0.01, elements=12)
    q = model.unknowns_of(np.stack([np.full_like(model.s, -0.5), model.s], axis=1), np.full(len(model.s), pi / 2.0))
    foot = np.arange(4)
    problem = Pushed(model, foot, q[foot], np.zeros(4), 0.0, load=-model.weight)
    steps = replace(STEPS, first=0.5, largest=0.5, kink=1e-6, newton=newton.NewtonOptions())
    first = continuation.start(problem, q, 0.0, NONE, 1.0, steps)
    count, before = 0, first
    for point in continuation.follow(problem, first, steps):
        count += len(point.state.residuals) - 1
        if critical.is_past(point) or point.lam > 20.0:
            break
        before = point
    found = critical.locate(problem, before, point, 1e-6, steps)
    # Weight times length cubed over bending stiffness.
    return Finding(found.lam ** (1.0 / 3.0), elastica.column_buckling_length(), 2e-3, count)


def _root_law(_: float) -> Finding:
    """The eigenvalue next to a fold vanishes as the root of what is left of the load."""
    arch = Arch.of(2.0)
    found, count = arch.critical()
    eigenvalues = []
    for left in (1e-4, 1e-6):
        state = newton.solve(arch.problem, found.before.q, found.lam * (1.0 - left), NONE, options=NEWTON)
        point = continuation.evaluate(arch.problem, state, Tangent(np.zeros(arch.q.size), 1.0))
        eigenvalues.append(abs(float(point.eigenvalues[0])))
        count += len(state.residuals) - 1
    return Finding(eigenvalues[0] / eigenvalues[1], 10.0, 0.5, count)


def _beyond_the_fold(_: float) -> None:
    """The load a little larger than the arch can bear: no state is near."""
    arch = Arch.of(2.0)
    found, _count = arch.critical()
    patient = replace(NEWTON, max_iterations=200, max_distance=0.5 * THICKNESS)
    newton.solve(arch.problem, found.before.q, found.lam * (1.0 + 1e-4), NONE, options=patient)


def _bordered(_: float) -> Finding:
    """A tangent that is singular to the last figures, in the bordered system of a continuation step."""
    arch = Arch.of(2.0)
    found, count = arch.critical()
    problem, held = arch.problem, arch.problem.prescribed
    k = problem.linearise(found.before.q, found.lam)[1]
    for _again in range(3):
        kept = k.with_fixed(held)
        values, mode = nearest_eigenvalues(problem, kept, kept.factor(), held, found.mode)
        k = k + problem.mass.scaled(-float(values[0]))
    kept = k.with_fixed(held)
    free = np.setdiff1d(np.arange(problem.size), held)
    column = np.where(np.isin(np.arange(problem.size), held), 0.0, -problem.load)
    row = problem.metric * mode
    row[held] = 0.0
    dense = np.column_stack([kept @ e for e in np.eye(problem.size)])[np.ix_(free, free)]
    whole = np.block([[dense, column[free, None]], [row[None, free], np.zeros((1, 1))]])
    # What should come out is given, so that the right side has its figures.
    exact = np.append(mode[free], 0.5)
    rhs = np.zeros(problem.size)
    rhs[free] = (whole @ exact)[:-1]
    x, y = solve_bordered(kept.factor(), kept, column, row, 0.0, rhs, float((whole @ exact)[-1]))
    error = float(np.abs(np.append(x[free], y) - exact).max() / np.abs(exact).max())
    return Finding(error, 0.0, 1e-7, count)


def _held_nowhere(_: float) -> None:
    """A strip that nothing holds has no equilibrium, and a singular tangent."""
    model = Rod.of(LENGTH, THICKNESS, elements=8)
    problem = HeldStrip(model, NONE, np.zeros(0), np.zeros(0))
    newton.solve(problem, np.zeros(model.size), 0.0, NONE)


def _exactly_singular(_: float) -> None:
    """Two unknowns that only a pivot could count."""
    Band(np.array([[0.0] * 2, [0.0, 1.0], [0.0, 0.0], [1.0, 0.0]]), 1).negatives()


def _repeated(_: float) -> Finding:
    """A rod between hinges, so thick that its lowest wave along and its lowest across are equally fast."""
    # Waves along it have the membrane's stiffness and, as the rod is made, a quarter of the bending's.
    thickness = 4.0 * LENGTH / pi
    model = Rod.of(LENGTH, thickness, elements=16)
    held = model.middle[[0, -1]].ravel()
    problem = HeldStrip(model, held, np.zeros(4), np.zeros(4), 0.0)
    k = model.force_and_tangent(np.zeros(model.size))[1]
    truth = (pi / LENGTH) ** 4
    above = (k + model.mass.scaled(-1.01 * truth)).with_fixed(held)
    kept = k.with_fixed(held)
    values, _mode = nearest_eigenvalues(problem, kept, kept.factor(), held)
    value = float(values[1]) if above.negatives() == 2 else nan
    return Finding(value, truth, 1e-3 * truth)


SOLVE = (SolveError,)
CASES = (
    Case(
        "arch below the cusp", CUSP, "w / h at lambda = h, closed form; no fold may be found", lambda _: _height_at(0.9)
    ),
    Case("arch at the cusp", CUSP, "the same where two folds have just met", lambda _: _height_at(1.0)),
    Case("arch beyond the cusp", CUSP, "lambda_c / h, closed form", lambda _: _fold(1.1)),
    Case("folds that meet", CUSP, "exponent of lambda_c towards the cusp", _folds_meet),
    Case("arch from both sides", EXACT, "ratio of both folds", _both_sides),
    Case("sway of a symmetric arch", EXACT, "lambda_c / h, closed form: a bifurcation before the fold", _sway),
    Case("column under its weight", EXACT, "buckling length of the elastica, L*", _column),
    Case("just before a fold", NEARBY_NEWTON, "ratio of eigenvalues, from the root law", _root_law),
    Case("just beyond a fold", NEARBY_NEWTON, "no state is near: an error", _beyond_the_fold, (NewtonError,)),
    Case("bordered, K singular to rounding", SINGULAR, "error of the solution, which is given", _bordered),
    Case("strip held nowhere", SINGULAR, "no equilibrium: an error", _held_nowhere, (NewtonError,)),
    Case("K that needs a pivot", SINGULAR, "its eigenvalues cannot be counted: an error", _exactly_singular, SOLVE),
    Case("double eigenvalue", REPEATED, "the second of two equal ones, closed form", _repeated),
    Case("fold and sway at once", REPEATED, "lambda_c / h, closed form", _fold_and_sway_at_once, SOLVE),
)
