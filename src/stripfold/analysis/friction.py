"""How much internal friction an R-path needs: the smallest with which the strip follows its plan, by either law.

All in units of L*, g/L* and rho_a g L*; see docs/physics.md, sections 5 and 8.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, sqrt

from stripfold.analysis import planning
from stripfold.analysis.contact import touch_position, touches
from stripfold.analysis.path_friction import Step, load_incrementally
from stripfold.analysis.path_statics import SIZES
from stripfold.analysis.static import StripModel
from stripfold.arrays import Array
from stripfold.effects import Effect, Hysteresis, Pull
from stripfold.errors import LostStabilityError, SolveError
from stripfold.models.model import Model
from stripfold.paths.rpath import RPath

LAWS = ("pull", "hysteresis")
"""The paper's pull towards the state before, and the bending hysteresis."""
FOLLOWED = 0.1
"""A strip follows its plan when it first touches this near to the planned place, L*."""
FIRST_GUESS = {"pull": 0.01, "hysteresis": 0.01}
"""Strength to begin the search with: k_f times the step, g; M_0, rho_a g L*^2."""
NARROW = 1.1
"""Ratio of the bracket's ends at which the search ends."""
MOST_TRIALS = 30


@dataclass(frozen=True, eq=False)
class Run:
    """An R-path followed with friction.

    Attributes
    ----------
    law, strength, step
        One of :data:`LAWS`; k_f in g/L* or M_0 in rho_a g L*^2; size of the steps, L*.
    steps
        Accepted steps.
    touch
        Index of the first step at which the strip touches, or None.
    touch_x
        Where, L*; nan without a touch.
    lost
        Why it ended before its end; empty if it did not.
    """

    law: str
    strength: float
    step: float
    steps: tuple[Step, ...]
    touch: int | None
    touch_x: float
    lost: str

    def followed(self, plan: RPath) -> bool:
        """Whether it first touches where it was planned to."""
        return abs(self.touch_x - plan.first_touch) < FOLLOWED


def effects_of(law: str, strength: float) -> Callable[[Model, Array], tuple[Effect, ...]]:
    """The effects of a law, slack in the state given; none for strength 0."""
    if strength == 0.0:
        return lambda model, q: ()
    if law == "pull":
        return lambda model, q: (Pull(model, strength, q),)
    return lambda model, q: (Hysteresis.of(model, strength, slack=q),)


def model_for(strip: StripModel, plan: RPath, refinement: float) -> Model:
    """A mesh fine where the plan lifts off."""
    free = strip.length - plan.lying_length
    return strip.model(planning.boundaries(strip.length, planning.Sweep(0.0, free), refinement, SIZES))


def follow(model: Model, plan: RPath, law: str, strength: float, step: float, to_end: bool = False) -> Run:
    """Follow an R-path from the flat strip to its first touch, or to its end."""
    steps: list[Step] = []
    touch, touch_x, lost = None, float("nan"), ""
    try:
        for new in load_incrementally(model, plan.path, effects_of(law, strength), step):
            steps.append(new)
            if touch is None and touches(model, new.point):
                touch, touch_x = len(steps) - 1, touch_position(model, new.point)
                if not to_end:
                    break
    except LostStabilityError as error:
        lost = str(error)
    return Run(law, strength, step, tuple(steps), touch, touch_x, lost)


def smallest(model: Model, plan: RPath, law: str, step: float) -> tuple[float, float]:
    """Bracket of the smallest strength with which the plan is followed to its first touch: fails, suffices.

    Raises
    ------
    SolveError
        When none does.
    """
    strength = FIRST_GUESS[law] / (step if law == "pull" else 1.0)
    fails, suffices = 0.0, inf
    for _ in range(MOST_TRIALS):
        if follow(model, plan, law, strength, step).followed(plan):
            suffices = strength
        else:
            fails = strength
        if suffices <= NARROW * fails:
            return fails, suffices
        if fails == 0.0:
            strength /= 2.0
        elif suffices == inf:
            strength *= 2.0
        else:
            strength = sqrt(fails * suffices)
    raise SolveError(
        f"no {law} friction between {fails:.3g} and {suffices:.3g} was found with which the plan is followed"
    )
