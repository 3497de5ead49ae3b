"""Forces on a strip besides its linear elasticity, weight and floor: bending laws, friction, self-contact."""

from stripfold.strip.bending_law import BendingLaw, MomentCurvature, split_loop
from stripfold.strip.effect import Effect, Reaction
from stripfold.strip.hysteresis import Hysteresis
from stripfold.strip.layer_friction import LayerFriction
from stripfold.strip.pull import Pull

__all__ = [
    "BendingLaw",
    "Effect",
    "Hysteresis",
    "LayerFriction",
    "MomentCurvature",
    "Pull",
    "Reaction",
    "split_loop",
]
