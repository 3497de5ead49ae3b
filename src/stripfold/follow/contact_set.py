"""A state whose contact is at nodes as one whose contact coordinates are unknowns, and back.

Motion in time finds the contact node by node on a fixed mesh; statics before and after it have moving meshes.
Lengths in L*.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import NewtonError, SolveError
from stripfold.follow.contact import lying_parts, touches
from stripfold.follow.contact_branch import BranchPoint, curvature, reaction, transferred
from stripfold.solve import continuation, newton
from stripfold.solve.newton import NewtonOptions
from stripfold.solve.problem import Point, Tangent
from stripfold.strip.contact_mesh import ContactMesh, Sizes, Topology
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import StripProblem

NODAL_SIZES = Sizes(free=0.15, lying=0.15, at_contact=0.01, growth=1.3)
"""Elements of a fixed mesh: the loop rolls over all of the strip, and where it is released no part is coarse."""
SAME_PART = 0.5
"""Largest distance between neighbours on the floor of one lying part, L*."""
ROBUST_NEWTON = NewtonOptions(max_iterations=100)
"""For guesses with a wrong contact set, which is corrected node by node."""
SHORT = 0.3
"""Length of a lying part below which it is first tried as a point, L*."""
BACK = (0.0, 1e-3, 3e-3, 1e-2, 3e-2, 0.1)
"""Distances in lambda before a limit point at which a stable state is looked for, in turn, L*."""
NEARBY_NEWTON = replace(ROBUST_NEWTON, max_distance=0.3)
"""For states known from another mesh; at a larger distance lies another state (L*)."""
ALONG = 1e-3
"""Distance along a branch of the two states whose difference is its direction on a fixed mesh, L*."""


def on_nodes(at: BranchPoint, refinement: float = 1.0, stable: bool = False) -> tuple[StripProblem, Point]:
    """A state on a fixed mesh of elements that suit a motion in time, as its problem and point.

    The lambda is about the same: on other elements a limit point lies elsewhere.  With ``stable`` the state lies before
    it.

    Raises SolveError: there is no such state.
    """
    mesh = replace(at.problem.mesh, sizes=NODAL_SIZES.scaled(refinement))
    new = transferred(BranchPoint(replace(at.problem, mesh=mesh), at.point))
    problem, point = new.problem.on_mesh(new.point)
    # Nodes move with the contact: the strip's own way is that on the same nodes.
    t, n, s = new.point.tangent, new.problem.n, problem.model.s
    ahead = new.point.q + ALONG * t.q
    there = new.problem.at(ahead[n:]).model
    moved = there.resampled(ahead[:n], s) - point.q
    tangent = Tangent(moved / ALONG, t.lam)
    for back in BACK if stable else BACK[:1]:
        with suppress(NewtonError):
            state = newton.solve(problem, point.q, point.lam - back, point.active, options=NEARBY_NEWTON)
            settled = continuation.evaluate(problem, state, tangent, point.arc)
            fallen = touches(problem.model, settled) and not touches(problem.model, point)
            if not fallen and not (stable and settled.negatives):
                return problem, settled
    if stable:
        # On coarse elements: the state whose contact coordinates are unknowns is close enough to fall from.
        return problem, replace(point, tangent=tangent)
    raise SolveError("there is no such state with contact at nodes", parameter=point.lam, advice="refine the mesh")


def from_nodes(plan: Callable[[Array], ContactMesh], problem: StripProblem, point: Point) -> BranchPoint:
    """The state near one whose contact is at nodes.

    ``plan``: plans a mesh with one lift-off.  ``problem``, ``point``: the state on its fixed mesh.  Raises SolveError:
    no such state is near.
    """
    model = problem.model
    parts = [model.s[part[[0, -1]]].tolist() for part in lying_parts(model, point, SAME_PART)]
    if parts[-1][0] == parts[-1][1]:
        raise SolveError("no part of the strip lies on the floor beside its held end", parameter=point.lam)
    mesh = plan(np.array([parts[-1][0]]))
    error = SolveError("no such state with contact coordinates is near", parameter=point.lam)
    for topology, contact in _guesses(parts, folded=bool(point.q[model.middle[0, 1]] <= 0.0)):
        new = MovingContact(mesh.replanned(contact, topology), problem.motion)
        q = np.concatenate([model.resampled(point.q, new.mesh.model.s), contact])
        try:
            found = _near(new, q, point.lam, model.resampled_stress(point.q, new.mesh.model))
        except SolveError as failed:
            error = failed
            continue
        # Near a limit point the same contact has a stable and an unstable state.
        if _admissible(found) and found.point.negatives == point.negatives:
            return found
    raise error


def _near(problem: MovingContact, q: Array, lam: float, stress: Array) -> BranchPoint:
    """The state at ``lam`` near a guess and its stress."""
    state = newton.solve(problem, q, lam, problem.bounded, None, NEARBY_NEWTON, stress)
    return BranchPoint(problem, continuation.evaluate(problem, state, Tangent(np.zeros(problem.size), 1.0)))


def _guesses(parts: list[list[float]], folded: bool) -> Iterator[tuple[Topology, Array]]:
    """The kinds of contact to try, with guesses of their coordinates; ``folded``: the gripper is on the floor.

    Behind its lift-off a strip on nodes waves by less than an element, and lies in more parts than it has: the nearest
    ones are taken for one, until one is left.
    """
    while True:
        (*upper, (lift_off, _)) = parts
        # Each upper layer as what it looks like, then as the other: a point or an interval.
        for other in (False, True) if len(upper) > folded else (False,):
            topology: Topology = ()
            contact: list[float] = []
            for number, (begin, end) in enumerate(upper):
                if folded and number == 0:
                    topology, contact = (True,), [end]
                elif (end - begin < SHORT) is not other:
                    topology, contact = (*topology, False), [*contact, 0.5 * (begin + end)]
                else:
                    middle, half = 0.5 * (begin + end), 0.5 * max(end - begin, 0.1)
                    topology, contact = (*topology, False, True), [*contact, middle - half, middle + half]
            yield (*topology, False, True), np.array([*contact, lift_off])
        if not upper:
            return
        i = int(np.argmin([after[0] - before[1] for before, after in pairwise(parts)]))
        parts = [*parts[:i], [parts[i][0], parts[i + 1][1]], *parts[i + 2 :]]


def _admissible(at: BranchPoint) -> bool:
    """Whether the parts are in order, and points are pushed and not flat."""
    numbers = at.problem.points.tolist()
    pushed = all(get(at.problem, i, at.point) >= 0.0 for i in numbers for get in (reaction, curvature))
    return pushed and bool(np.all(np.diff(at.contact) > 0.0))
