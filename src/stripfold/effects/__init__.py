"""What acts on a strip beside its elasticity, its weight and the floor: internal friction.

Both laws here remember the last accepted state (``docs/physics.md``, section 8).
"""

from stripfold.effects.effect import Effect
from stripfold.effects.hysteresis import Hysteresis
from stripfold.effects.pull import Pull

__all__ = ["Effect", "Hysteresis", "Pull"]
