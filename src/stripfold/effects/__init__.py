"""Forces on a strip besides its linear elasticity, weight and floor: bending laws, internal friction, self-contact."""

from stripfold.effects.bending_law import BendingLaw, MomentCurvature, split_loop
from stripfold.effects.effect import Effect
from stripfold.effects.hysteresis import Hysteresis
from stripfold.effects.pull import Pull

__all__ = ["BendingLaw", "Effect", "Hysteresis", "MomentCurvature", "Pull", "split_loop"]
