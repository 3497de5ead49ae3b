"""The heavy elastica: the planning model and the independent truth (docs/physics.md, sections 4 and 5).

An inextensible, infinitely thin strip under its own weight, solved by Chebyshev collocation to about
1e-11.  Everything is dimensionless: lengths in L* = (eta_b g)^(-1/3), forces per width in the
weight of a piece of length L*, bending stiffness 1.  Only the names that say so use SI units.

Examples
--------
>>> from stripfold import elastica
>>> point = elastica.critical(3.0)
>>> round(point.advance, 6), point.snap
(9.856908, True)
"""

from stripfold.elastica.branch import state_at, state_no_horizontal_force, x_axis_branch
from stripfold.elastica.classics import cantilever, cantilever_length, column_buckling_length
from stripfold.elastica.critical_point import (
    Critical,
    MasterCurve,
    Touch,
    critical,
    master_curve,
    resolved_again,
    touch_limit,
)
from stripfold.elastica.fold import (
    FoldedLoop,
    eta_b_from_fold_height,
    fold_roots,
    folded_loop,
    gravity_length,
    half_fold_lying_length,
)
from stripfold.elastica.state import Profile, Sag, State

__all__ = [
    "Critical",
    "FoldedLoop",
    "MasterCurve",
    "Profile",
    "Sag",
    "State",
    "Touch",
    "cantilever",
    "cantilever_length",
    "column_buckling_length",
    "critical",
    "eta_b_from_fold_height",
    "fold_roots",
    "folded_loop",
    "gravity_length",
    "half_fold_lying_length",
    "master_curve",
    "resolved_again",
    "state_at",
    "state_no_horizontal_force",
    "touch_limit",
    "x_axis_branch",
]
