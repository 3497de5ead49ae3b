"""What the film shows, compared with its description in recording.yaml."""

from __future__ import annotations

import numpy as np

from stripfold.base.errors import MeasurementError
from stripfold.film.recording import MAX_HEIGHT_ERROR, NAME, Entries, middle_speed, other_unit
from stripfold.film.tracking import Tracks

MAX_FLAT_END_ERROR = 0.08
"""Largest difference between measured and described ``flat_end``, as a share of the strip's length: of tight bends a
low camera sees the inner side, which is shorter, and the middle of a wide strip lies behind the folding plane."""
MAX_SPEED_RATIO = 5.0
"""Described speed over that of the film, or the reverse, from which on a unit must be wrong."""
MIN_ADVANCE = 0.002
"""Least motion of the gripper that has a direction, m."""


def compare(entries: Entries, tracks: Tracks) -> None:
    """Refuse a description that the film contradicts; lambda would be wrong.

    Raises MeasurementError: the gripper's height, direction or speed, or the place of the flat strip, are not as
    described.
    """
    gripper = entries.gripper
    z = float(np.median(tracks.gripped_end[tracks.gripper.tracked, 1]))
    _agree(
        abs(z - gripper.height) <= MAX_HEIGHT_ERROR * gripper.height,
        f"gripper.height = {gripper.height:g} m, the video shows {z:.4f} m",
        f"a height within {MAX_HEIGHT_ERROR:.0%} of the description",
        other_unit(gripper.height, z)
        or "is z of the robot 0 on the table, and the offset of gripper.marker or template right?",
    )
    first, last = tracks.gripped_end[[0, -1], 0]
    _agree(
        gripper.direction * (last - first) > -MIN_ADVANCE,
        f"gripper.direction = {gripper.direction}, in the video x of the gripper goes from {first:.3f} to {last:.3f} m",
        "a gripper that advances in its direction",
        "change the direction; or has x a wrong sign in the table of the robot grid?",
    )
    speed = middle_speed(tracks.grip_time, tracks.gripped_end[:, 0])
    _agree(
        abs(last - first) < MIN_ADVANCE or 1.0 / MAX_SPEED_RATIO < speed / gripper.speed < MAX_SPEED_RATIO,
        f"gripper.speed = {gripper.speed:g} m/s, the video shows {speed:.2g} m/s",
        "about the described speed",
        other_unit(gripper.speed, speed) or "are the times of the frames in s?",
    )
    found = flat_end(entries, tracks)
    _agree(
        abs(found - gripper.flat_end) <= MAX_FLAT_END_ERROR * entries.strip.length,
        f"gripper.flat_end = {gripper.flat_end:g} m, by the lying part in the video it was at {found:.3f} m",
        f"a difference of at most {MAX_FLAT_END_ERROR:.0%} of the strip's length",
        other_unit(gripper.flat_end, found) or "is it x of the robot at the near end of the flat strip, with its sign?",
    )


def flat_end(entries: Entries, tracks: Tracks) -> float:
    """x of the gripped end while the strip lay flat, m: the last point of the lying part less its arc length.

    It is too far ahead by what the bends are seen too short, 1 to 3 % of the length.
    """
    far = float(np.nanmedian(tracks.points[:, -1, 0]))
    return far - entries.gripper.direction * float(tracks.stations[-1])


def _agree(holds: bool, found: str, needed: str, advice: str) -> None:
    if not holds:
        raise MeasurementError(NAME, found, needed, advice)
