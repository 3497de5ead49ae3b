"""A motion in time up to the strip at rest.

In units of L*, sqrt(L*/g) and rho_a g L*.  Source: docs/physics.md, section 6.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf

from stripfold.base.errors import TimeStepError
from stripfold.solve import dynamics
from stripfold.solve.drive import Drive
from stripfold.solve.dynamics import TimeEvent, TimeOptions, TimeState
from stripfold.solve.schemes import Damping, Scheme
from stripfold.strip.problem import StripProblem

REST = 1e-6
"""Kinetic energy, as a share of the energy that weight, elasticity and gripper gave to the motion or took from it,
below which a strip is at rest; that of a disturbance is not counted, so that a slow start is not rest."""
QUIET = 2.0
"""Time for which it must stay below: longer than between two turning points of an oscillation."""
LONGEST = 400.0
"""Longest time to rest or to another event; longer with damping, which slows the start of a fall."""


def to_rest(
    problem: StripProblem,
    so_far: Sequence[TimeState],
    drive: Drive,
    damping: Damping,
    options: TimeOptions,
    *until: TimeEvent,
    scheme: Scheme | None = None,
    moving: float = 0.0,
) -> Iterator[TimeState]:
    """Yield states from the last one so far to rest, or to an earlier event of ``until``.

    ``so_far``: the motion up to there, its first state at least.  ``moving``: time for which the gripper moves first:
    no rest.  Raises TimeStepError: none of this happens, or no time step succeeds; with the last good state and its
    ``mid_surface``.
    """
    disturbance, begin = so_far[0].energy.kinetic, max(so_far[-1].t, moving)
    longest = LONGEST * (1.0 + damping.air + damping.stiffness)
    quiet_since = inf

    def rests(state: TimeState) -> bool:
        nonlocal quiet_since
        still = state.t >= moving and state.energy.kinetic <= REST * abs(state.energy.lost - disturbance)
        quiet_since = min(quiet_since, state.t) if still else inf
        return state.t - quiet_since > QUIET

    ends, late = (*until, TimeEvent(rests)), TimeEvent(lambda state: state.t > begin + longest)
    try:
        for state in dynamics.march(problem, so_far[-1], drive, damping, scheme, options, (*ends, late)):
            yield state
            if late.happened(state) and not any(event.happened(state) for event in ends):
                raise TimeStepError(
                    f"the strip did not come to rest within {state.t - begin:.0f} sqrt(L*/g)",
                    parameter=state.lam,
                    advice="add damping, hold the gripper, or give a larger disturbance",
                    last=state,
                )
    except TimeStepError as error:
        error.details["mid_surface"] = problem.model.mid_surface(error.last.q)
        raise
