"""Forces on a strip besides its linear elasticity, weight and floor: bending laws, friction, self-contact."""

from stripfold.effects.bending_law import BendingLaw, MomentCurvature, split_loop
from stripfold.effects.effect import Effect, MovableEffect, Reaction
from stripfold.effects.hysteresis import Hysteresis
from stripfold.effects.layer_friction import LayerFriction
from stripfold.effects.pull import Pull

__all__ = [
    "BendingLaw",
    "Effect",
    "Hysteresis",
    "LayerFriction",
    "MomentCurvature",
    "MovableEffect",
    "Pull",
    "Reaction",
    "split_loop",
]
