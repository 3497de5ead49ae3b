"""Where the gripper goes: the folding paths of the paper, the low path, and a user's own (docs/physics.md, section 9).

These functions take a strip and give a path in SI; the modules below work in units of L*.
"""

from stripfold.paths.fold_path import PLANS, FoldPath, circular, low, r_path, read, triangular

__all__ = ["PLANS", "FoldPath", "circular", "low", "r_path", "read", "triangular"]
