"""Diagnostics of the accepted points of a branch, in solver units.

Forces follow ``docs/physics.md``, section 4: X points from the lying part to the free part, towards -x, and
``(F_x, F_z)`` is the force across a section that the part nearer the gripper exerts on the rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stripfold.base.arrays import Array
from stripfold.follow.contact_branch import BranchPoint

NEAR_END = 0.01
"""Share of the first element over which the direction of the grasped end is taken."""


@dataclass(frozen=True)
class Record:
    """Diagnostics of one point; lengths in L*, forces in rho_a g L*, energies in rho_a g L*^2 per width."""

    lam: float
    tangent_lam: float
    eigenvalues: Array
    negatives: int
    newton_iterations: int
    residual: float
    contacts: int
    minimal_gap: float
    force_x: float
    force_z: float
    elastic_energy: float
    gravity_energy: float
    first_integral_error: float


def record(at: BranchPoint) -> Record:
    """The diagnostics of a point."""
    problem, point = at.problem.on_mesh(at.point)
    model, q = problem.model, point.q
    middle = model.mid_surface(q)
    # The gripper's force on the strip, in the paper's frame.
    gripper_x, gripper_z = problem.residual(q, point.lam)[model.middle[0]]
    # The elastica's X axis points the other way.
    force_x, force_z = -gripper_x, gripper_z
    near = NEAR_END * model.ends[1] * np.arange(3.0)
    tangent = _end_tangent(near, model.resampled_mid_surface(q, near))
    along = -tangent[0] * force_x + tangent[1] * force_z
    return Record(
        lam=point.lam,
        tangent_lam=point.tangent.lam,
        eigenvalues=point.eigenvalues,
        negatives=point.negatives,
        newton_iterations=len(point.state.residuals) - 1,
        residual=point.state.residuals[-1],
        contacts=len(point.state.active),
        minimal_gap=float(np.min(q[problem.bounded] - problem.lower)),
        force_x=float(gripper_x),
        force_z=float(gripper_z),
        elastic_energy=model.energy(q),
        gravity_energy=float(model.weight @ q),
        first_integral_error=_first_integral(along, force_x, middle[0, 1], 12.0 / model.thickness**2),
    )


def _first_integral(along: float, force_x: float, height: float, membrane: float) -> float:
    """``T + T^2/2EA - z - (F_x + F_x^2/2EA)`` with T the gripper's force along the tangent.

    The elastica's integral (``docs/physics.md``, section 4) with the stretch energy of a strip that gives; zero in an
    exact equilibrium.
    """
    return float(along + along**2 / (2.0 * membrane) - height - force_x - force_x**2 / (2.0 * membrane))


def _end_tangent(s: Array, middle: Array) -> Array:
    """Unit tangent at the gripper, pointing away from the lying part, by a parabola through the three end nodes."""
    h1, h2 = s[1] - s[0], s[2] - s[0]
    slope = (middle[1] - middle[0]) * h2 / (h1 * (h2 - h1)) - (middle[2] - middle[0]) * h1 / (h2 * (h2 - h1))
    return np.asarray(-slope / np.linalg.norm(slope))
