"""Delay of the snap by friction in bending, to first order (docs/physics.md, section 8)."""

from __future__ import annotations

import numpy as np

from stripfold.elastica.branch import state_at
from stripfold.elastica.critical_point import critical


def friction_delay(z: float, difference: float = 1e-4) -> float:
    """Rise of lambda_c over the friction moment M_0 for small M_0, L* per rho_a g L*^2; nan without a snap.

    At the maximum of lambda each section bends on as in the critical mode.  By virtual work on that mode the friction
    shifts the maximum by M_0 times the integral of |d kappa|, at fixed places of the strip, over the change of the
    horizontal force; both are differences of states of the branch, ``difference`` L* of free length to either side.

    Examples
    --------
    >>> round(friction_delay(3.0), 2)
    9.6
    """
    point = critical(z)
    if not point.snap:
        return float("nan")
    at = point.state
    before, after = (state_at(z, at.length + d, at) for d in (-difference, difference))
    # From the gripper, so that places belong to the strip.
    s = np.linspace(0.0, before.length, 4001)
    change = after.at(after.length - s).curvature - before.at(before.length - s).curvature
    return float(np.trapezoid(np.abs(change), s)) / abs(after.force_x - before.force_x)
