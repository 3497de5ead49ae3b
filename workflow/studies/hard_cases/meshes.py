"""Hard cases of the mesh: coarse, fine, distorted, inside out, and strips that are pressed so."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from stripfold import elastica
from stripfold.analysis.static import StripModel
from stripfold.arrays import Array
from stripfold.errors import CrushedError, InvalidInputError, SolveError
from stripfold.models.model import Model
from stripfold.models.rod import Rod
from stripfold.models.solid import Solid
from stripfold.solve import newton
from studies.hard_cases.case import Case, Finding
from studies.hard_cases.strips import PAPERS, end_against_elastica
from studies.modes import HeldStrip

MESHES, DISTORTED, CRUSHED = "coarse and very fine meshes", "distorted meshes", "near-inverted elements"
LENGTH, THICKNESS, ELEMENTS = 2.0, 0.02, 40


def sheared(amount: float) -> Callable[[Array], Array]:
    """Columns of a cantilever's mesh leaning to and fro by ``amount`` of an element: at 0.5 their ends meet."""
    size = LENGTH / ELEMENTS

    def distort(points: Array) -> Array:
        column = np.round((points[0] + LENGTH / 2.0) / size)
        inside = (column > 0) & (column < ELEMENTS)
        lean = np.where(inside, (-1.0) ** column, 0.0) * amount * size
        return np.asarray(np.stack([points[0] + 2.0 * lean * points[1] / THICKNESS, points[1]]))

    return distort


def _droop(amount: float, allowed: float) -> Finding:
    """The chord's angle of a cantilever under its weight."""
    model = Solid.of(LENGTH, THICKNESS, elements=ELEMENTS, distort=sheared(amount))
    clamp = model.mesh.unknowns[0].ravel()
    problem = HeldStrip(model, clamp, np.zeros(len(clamp)), np.zeros(len(clamp)))
    options = newton.NewtonOptions(max_iterations=100)
    state = newton.solve(problem, np.zeros(model.size), 0.0, problem.bounded, options=options)
    place = model.mid_surface(state.q)
    chord = place[-1] - place[0]
    angle = float(np.arctan2(-chord[1], chord[0]))
    return Finding(angle, elastica.cantilever(LENGTH).droop_angle, allowed, len(state.residuals) - 1)


def _inverted(_: float) -> None:
    Solid.of(LENGTH, THICKNESS, elements=ELEMENTS, distort=sheared(0.6))


def _pressed(model: Model, to: float) -> None:
    """Both ends held, the strip in between pressed to a share of its length, a guess that is in equilibrium."""
    q = np.zeros(model.size)
    q[model.middle[:, 0]] = (to - 1.0) * model.s
    if isinstance(model, Rod):
        q[2::4] = to - 1.0
    held = model.middle[[0, -1]].ravel()
    problem = HeldStrip(model, held, q[held], np.zeros(4), 0.0)
    newton.solve(problem, q, 0.0, problem.bounded)


NO_STRIP = (CrushedError,)
CASES = (
    Case(
        "very coarse mesh",
        MESHES,
        "lambda_c, elastica",
        lambda r: end_against_elastica(StripModel(9.0, PAPERS), 3.0, 4.0 * min(r, 1.5)),
        (SolveError,),
    ),
    Case(
        "very fine mesh",
        MESHES,
        "lambda_c, elastica",
        lambda r: end_against_elastica(StripModel(9.0, PAPERS), 3.0, 0.25 * r),
    ),
    Case("leaning elements", DISTORTED, "droop of a cantilever, elastica", lambda _: _droop(0.25, 3e-3)),
    Case("elements all but turned over", CRUSHED, "droop of a cantilever, elastica", lambda _: _droop(0.475, 1e-2)),
    Case("elements turned over", CRUSHED, "no mesh: an error", _inverted, (InvalidInputError,)),
    Case(
        "strip turned inside out",
        CRUSHED,
        "no strip: an error",
        lambda _: _pressed(Solid.of(2.0, 0.1, elements=8), -0.2),
        NO_STRIP,
    ),
    Case(
        "rod pressed to a fifth",
        CRUSHED,
        "no strip: an error",
        lambda _: _pressed(Rod.of(2.0, 0.1, elements=8), 0.2),
        NO_STRIP,
    ),
)
