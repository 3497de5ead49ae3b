"""Gripper paths: those of the paper, and a user's own (docs/physics.md, section 9)."""

from stripfold.paths.curve import GripperPath, Piece
from stripfold.paths.geometric import circular, triangular
from stripfold.paths.rpath import LONGEST, RPath, path_of, plan_r_path, shortest_half_fold
from stripfold.paths.table import as_text, read, write

__all__ = [
    "LONGEST",
    "GripperPath",
    "Piece",
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
