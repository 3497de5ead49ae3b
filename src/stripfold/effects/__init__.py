"""Forces on a strip besides its elasticity, its weight and the floor: internal friction and self-contact."""

from stripfold.effects.effect import Effect
from stripfold.effects.hysteresis import Hysteresis
from stripfold.effects.pull import Pull

__all__ = ["Effect", "Hysteresis", "Pull"]
