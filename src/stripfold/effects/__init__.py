"""What acts on a strip beside its elasticity, its weight and the floor: internal friction.

Both laws here remember the last accepted state (``docs/physics.md``, section 8).
"""

from .effect import Effect
from .hysteresis import Hysteresis
from .pull import Pull

__all__ = ["Effect", "Hysteresis", "Pull"]
