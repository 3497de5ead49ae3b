"""Where the gripper goes: the folding paths of the paper, and a user's own (docs/physics.md, section 5)."""

from .curve import GripperPath, Piece
from .geometric import circular, triangular
from .rpath import PlannedState, RPath, plan_r_path
from .table import read, write

__all__ = [
    "GripperPath",
    "Piece",
    "PlannedState",
    "RPath",
    "circular",
    "plan_r_path",
    "read",
    "triangular",
    "write",
]
