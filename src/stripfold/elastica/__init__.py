"""The heavy elastica: the planning model and the independent truth (docs/physics.md, sections 4 and 5).

An inextensible, infinitely thin strip under its own weight, solved by Chebyshev collocation to about 1e-11. All
quantities are dimensionless: lengths in L* = (eta_b g)^(-1/3), forces per width in the weight of a length L*, bending
stiffness 1; functions that take or return SI units say so.

Examples
--------
>>> from stripfold import elastica
>>> point = elastica.critical(3.0)
>>> round(point.advance, 6), point.snap
(9.856908, True)
"""

from stripfold.elastica.barrier import BistableRange, bistable_range
from stripfold.elastica.branch import state_at, state_at_advance, state_no_horizontal_force, x_axis_branch
from stripfold.elastica.critical_point import (
    CriticalPoint,
    EndOfAdvance,
    critical,
    end_of_advance,
    friction_delay,
    touch_limit,
)
from stripfold.elastica.state import Profile, Sag, State
from stripfold.elastica.textile import (
    FoldedLoop,
    cantilever,
    eta_b_from_fold_height,
    eta_b_from_hanging_loop,
    folded_loop,
    half_fold_lying_length,
)

__all__ = [
    "BistableRange",
    "CriticalPoint",
    "EndOfAdvance",
    "FoldedLoop",
    "Profile",
    "Sag",
    "State",
    "bistable_range",
    "cantilever",
    "critical",
    "end_of_advance",
    "eta_b_from_fold_height",
    "eta_b_from_hanging_loop",
    "folded_loop",
    "friction_delay",
    "half_fold_lying_length",
    "state_at",
    "state_at_advance",
    "state_no_horizontal_force",
    "touch_limit",
    "x_axis_branch",
]
