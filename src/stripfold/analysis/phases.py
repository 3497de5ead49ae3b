"""Phases of a simulated collapse, as its dataset names them: statics to lambda_c, the fall, statics from rest on."""

from __future__ import annotations

BEFORE, FALL, AFTER = PHASES = "before", "fall", "after"
