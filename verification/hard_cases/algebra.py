"""Hard cases of linear algebra and mesh: singular tangents, equal eigenvalues, elements turned inside out."""

from __future__ import annotations

from collections.abc import Callable
from math import nan, pi

import numpy as np

from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.solve import newton
from stripfold.solve.linear import BandPattern, solve_bordered
from stripfold.solve.stability import nearest_eigenvalues
from stripfold.strip.model import Model
from stripfold.strip.reference import Reference
from stripfold.strip.rod import Rod
from verification.dynamics import HeldStrip
from verification.hard_cases.arch import LENGTH, NONE, THICKNESS, Arch
from verification.hard_cases.case import Finding, refined

CANTILEVER, THIN, COLUMNS = 2.0, 0.02, 80
"""Length and thickness, L*, and elements of a cantilever whose mesh is distorted."""


def bordered() -> Finding:
    """Error of a bordered solution whose tangent is singular to the last figures."""
    arch = Arch.of(2.0)
    found = arch.critical()
    problem, held = arch.problem, arch.problem.prescribed
    k = problem.linearise(found.before.q, found.lam)[1]
    for _ in range(3):
        kept = k.with_fixed(held)
        values, mode = nearest_eigenvalues(problem.mass, kept, kept.factor(), held, found.mode)
        k = k + problem.mass.scaled(-float(values[0]))
    kept = k.with_fixed(held)
    free = np.setdiff1d(np.arange(problem.size), held)
    column = np.where(np.isin(np.arange(problem.size), held), 0.0, -problem.load)
    row = problem.metric * mode
    row[held] = 0.0
    dense = np.column_stack([kept @ e for e in np.eye(problem.size)])[np.ix_(free, free)]
    whole = np.block([[dense, column[free, None]], [row[None, free], np.zeros((1, 1))]])
    # The solution is given, so that the right side has all its figures.
    exact = np.append(mode[free], 0.5)
    rhs = np.zeros(problem.size)
    rhs[free] = (whole @ exact)[:-1]
    x, y = solve_bordered(kept, column, row, 0.0, rhs, float((whole @ exact)[-1]))
    error = float(np.abs(np.append(x[free], y) - exact).max() / np.abs(exact).max())
    return Finding(error, 0.0, 0.0, 1e-11)


def held_nowhere() -> None:
    """A strip that nothing holds has no equilibrium, and a singular tangent."""
    model = Rod.of(LENGTH, THICKNESS, elements=8)
    newton.solve(HeldStrip(model, NONE, np.zeros(0), np.zeros(0)), np.zeros(model.size), 0.0, NONE)


def needs_a_pivot() -> None:
    """Two unknowns whose negative eigenvalues cannot be counted without a pivot."""
    BandPattern.of(np.array([[0, 1]]), 2).assemble(np.array([[[0.0, 1.0], [1.0, 0.0]]])).negatives()


def double_eigenvalue() -> Finding:
    """A rod between hinges, so thick that its lowest wave along and its lowest across are equally fast."""
    # Waves along it have the membrane's stiffness and, as the rod is made, a quarter of the bending's.
    thickness, truth = 4.0 * LENGTH / pi, (pi / LENGTH) ** 4

    def value_at(refinement: float) -> float:
        model = Rod.of(LENGTH, thickness, elements=round(16 / refinement))
        held = model.middle[[0, -1]].ravel()
        problem = HeldStrip(model, held, np.zeros(4), np.zeros(4), 0.0)
        k = model.force_and_tangent(np.zeros(model.size))[1]
        above = (k + model.mass.scaled(-1.01 * truth)).with_fixed(held)
        kept = k.with_fixed(held)
        values, _ = nearest_eigenvalues(problem.mass, kept, kept.factor(), held)
        return float(values[1]) if above.negatives() == 2 else nan

    return refined(value_at, 1.0, truth)


def sheared(amount: float, elements: int = COLUMNS) -> Callable[[Array], Array]:
    """Columns of a cantilever's mesh leaning to and fro by ``amount`` of an element: at 0.5 their ends meet."""
    size = CANTILEVER / elements

    def distort(points: Array) -> Array:
        column = np.round((points[0] + CANTILEVER / 2.0) / size)
        inside = (column > 0) & (column < elements)
        lean = np.where(inside, (-1.0) ** column, 0.0) * amount * size
        return np.asarray(np.stack([points[0] + 2.0 * lean * points[1] / THIN, points[1]]))

    return distort


def droop(amount: float) -> Finding:
    """Angle of the chord of a cantilever under its weight, on a distorted mesh."""

    def value_at(refinement: float) -> float:
        elements = round(COLUMNS / refinement)
        model = Reference.of(CANTILEVER, THIN, elements=elements, distort=sheared(amount, elements))
        clamp = model.unknowns[0].ravel()
        problem = HeldStrip(model, clamp, np.zeros(len(clamp)), np.zeros(len(clamp)))
        options = newton.NewtonOptions(max_iterations=100)
        place = model.mid_surface(newton.solve(problem, np.zeros(model.size), 0.0, NONE, options=options).q)
        chord = place[-1] - place[0]
        return float(np.arctan2(-chord[1], chord[0]))

    return refined(value_at, 1.0, elastica.cantilever(CANTILEVER).droop_angle, THIN**2)


def turned_over() -> None:
    """A mesh with elements inside out."""
    Reference.of(CANTILEVER, THIN, elements=COLUMNS, distort=sheared(0.6))


def pressed(model: Model, to: float) -> None:
    """Both ends held, the strip in between pressed to a share of its length, a guess that is in equilibrium."""
    q = np.zeros(model.size)
    q[model.middle[:, 0]] = (to - 1.0) * model.s
    if isinstance(model, Rod):
        q[2::4] = to - 1.0
    held = model.middle[[0, -1]].ravel()
    newton.solve(HeldStrip(model, held, q[held], np.zeros(4), 0.0), q, 0.0, NONE)
