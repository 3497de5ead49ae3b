"""Phases of a strip that is followed: statics, a fall, statics from rest on; or all in time, with a slow gripper.

The dataset of a collapse names the first three.
"""

from __future__ import annotations

BEFORE, FALL, AFTER = PHASES = "before", "fall", "after"
SLOW = "slow"
