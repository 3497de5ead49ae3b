"""The smallest eigenvalue of an equilibrium: second variation of its energy against the mass.  In g/L*.

The free part is inextensible, held at lift-off, where neither slope nor curvature jumps, and at the hinge of the
gripper.  For a change v of the angle the energy changes by half the integral of v'^2 + (F_x cos theta + F_z sin theta)
v^2, and a point moves by the integral of v (-sin theta, cos theta).
"""

from __future__ import annotations

import numpy as np

from stripfold.elastica._chebyshev import grid
from stripfold.elastica.state import State


def smallest_eigenvalue(state: State) -> float:
    """Smallest eigenvalue of a stable state, g/L*; nan for an unstable one.

    Examples
    --------
    >>> from stripfold.elastica import state_at_advance
    >>> round(smallest_eigenvalue(state_at_advance(3.0, 8.0)), 4)
    0.5952
    """
    from scipy.linalg import LinAlgError, eigh

    g = grid(state.s.size)
    weights, integral = state.length * g.integral[-1], state.length * g.integral
    cos, sin = np.cos(state.theta), np.sin(state.theta)
    # Unknown is v' at the nodes, times the root of the weight: the stiffness is then near the identity.
    angle = integral / np.sqrt(weights)
    moved = [integral @ (part[:, None] * angle) for part in (-sin, cos)]
    tension = weights * (state.force_x * cos + (state.force_0 + state.s) * sin)
    stiffness = np.eye(weights.size) + angle.T @ (tension[:, None] * angle)
    mass = sum(part.T @ (weights[:, None] * part) for part in moved)
    held = np.linalg.qr(np.stack([part[-1] for part in moved], axis=1), mode="complete")[0][:, 2:]
    last = weights.size - 3
    try:
        # The largest of the inverse problem: the mass is nearly singular.
        found = eigh(held.T @ mass @ held, held.T @ stiffness @ held, eigvals_only=True, subset_by_index=(last, last))
    except LinAlgError:
        return float("nan")
    return 1.0 / float(found[0])
