"""Where the gripper goes: the folding paths of the paper, and a user's own (docs/physics.md, section 5)."""

from stripfold.paths.curve import GripperPath, Piece
from stripfold.paths.geometric import circular, triangular
from stripfold.paths.rpath import LONGEST, PlannedState, RPath, path_of, plan_r_path, shortest_half_fold
from stripfold.paths.table import as_text, read, write

__all__ = [
    "LONGEST",
    "GripperPath",
    "Piece",
    "PlannedState",
    "RPath",
    "as_text",
    "circular",
    "path_of",
    "plan_r_path",
    "read",
    "shortest_half_fold",
    "triangular",
    "write",
]
