"""The strip followed from frame to frame: what was found guides the next search, and what cannot be is refused."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from stripfold.arrays import Array
from stripfold.errors import TrackingError
from stripfold.vision.centreline import Centreline, find
from stripfold.vision.following import Followed, Look, between, first_look, follow
from stripfold.vision.mapping import Mapping
from stripfold.vision.measuring import GOOD
from stripfold.vision.sections import interpolated
from stripfold.vision.smooth import median
from stripfold.vision.video import Frame

POINTS = 80
"""Points measured along the strip."""
LONGEST_LOSS = 0.5
"""For how long the strip may be lost at a time, s."""
HELD = 0.98
"""Share of the strip's length up to which it is followed: its held end is hidden."""
FASTER = 2.0
"""How many times faster than in the last frame the strip may be in the next."""
FASTEST = 5.0
"""Speed of its fastest point that is not searched beyond, visible lengths per second."""
PLAIN = 0.85
"""Share of the strip that is seen from which it is not searched for farther away."""
LONGER = 0.012
"""How much longer than at first a line may seem, as a share: one that goes astray makes a detour."""
SHORTER = 0.02
"""How much shorter: of a tight bend the inner side is seen, the more of it the lower the camera."""
DETOUR, DETOUR_RATE = 0.003, 0.03
"""How much longer than in the frame before, as a share, and how much more of it per second."""
REMEMBERED = 1.0
"""How far back the usual length is looked for, s."""
CUT_SHORT = 0.85
"""Length, as a share of the strip's, below which a line with both ends in view has left some of the strip out."""
ASTRAY = 0.5
"""How far a line may begin from where the gripper holds the strip, in widths of it."""
RIM = 1.6
"""Size of the marker with its rim, in the marker's own."""
DROPPED = 0.03
"""Distance of the strip from where the gripper should hold it, as a share of its length, that means it does not."""


class StripTracker:
    """Follows the strip from frame to frame: call it with each in turn and the pixel of its gripped end."""

    def __init__(self, mapping: Mapping, length: float, source: str) -> None:
        self._mapping, self._longest, self._source = mapping, HELD * length, source
        self._last: Centreline | None = None
        self._look: Look | None = None
        self._aside = np.zeros(2)  # of the line's first point from the gripped end, pixels
        self._laid = np.zeros(2)  # its last point, which does not move
        self._length = 0.0  # of the first line, m
        self._lengths: list[tuple[float, float]] = []  # times and lengths of the lines of late, s and m
        self._since = 0.0
        self._motion = np.zeros((POINTS, 2))  # of each point, pixels per second
        self._first = np.nan

    def __call__(self, frame: Frame, end: Array, marker: Array) -> Centreline | None:
        """The strip in the next frame, or None where it is lost for a moment; ``marker`` are its corners, (4, 2).

        Raises
        ------
        TrackingError
            It is not in the first frames, is lost for long, or is not where the gripper holds it.
        """
        if self._last is None:
            return self._begun(frame, end, marker)
        found = self._followed(frame, end)
        if found is not None:
            self._accept(frame.time, *found)
            return found[0].line
        if frame.time - self._since > LONGEST_LOSS:
            raise TrackingError(
                self._source,
                f"the strip is lost at {frame.time:.3f} s",
                f"the strip in view, but for gaps of up to {LONGEST_LOSS:g} s",
                "light it evenly, before a background much darker or brighter, and film from the side",
            )
        return None

    def _begun(self, frame: Frame, end: Array, marker: Array) -> Centreline | None:
        """The strip of the first frame in which all of it is seen."""
        if np.isnan(self._first):
            self._first = frame.time
        try:
            line = find(without(frame.image, marker), end, points=POINTS, source=self._source)
            line = self._complete(self._held(line, end))
        except TrackingError:
            if frame.time - self._first > LONGEST_LOSS:
                raise
            return None
        line = self._without_rest(_joined_to(line, end))
        self._length = self._metres(line)
        self._lengths = [(frame.time, self._length)]
        self._aside, self._laid = line.points[0] - end, line.points[-1]
        self._last, self._look, self._since = line, first_look(frame.image, line), frame.time
        return line

    def _followed(self, frame: Frame, end: Array) -> tuple[Followed, float] | None:
        """The strip next to where it was, and its length, m."""
        last, look = self._last, self._look
        assert last is not None
        assert look is not None
        passed = frame.time - self._since
        moved = replace(last, points=last.points + passed * self._motion)
        ends = np.stack([end + self._aside, self._laid])
        usual = median(look.width)
        near = 0.25 * usual + 1.5 + FASTER * float(np.quantile(np.hypot(*self._motion.T), 0.9)) * passed
        far = min(4.0 * near + usual, 4.0 * usual + 16.0)
        best: Followed | None = None
        of_best = 0.0
        for guess, reach in ((moved, near), (moved, far), (last, far)):
            # What passes in front may have taken the line along: then the strip is where it was, not where that went.
            if guess is last and best is not None and best.sound:
                break
            found = follow(frame.image, guess, look, ends, reach)
            if found is None:
                continue
            length = self._metres(found.line)
            if not self._of_length(length, passed):
                continue
            if np.hypot(*(found.line.points[0] - ends[0])) > ASTRAY * usual + 1.0:
                continue
            if best is None or found.share > best.share:
                best, of_best = found, length
            if best.sound and best.share > PLAIN:
                break
        return (best, of_best) if best is not None and best.sound else None

    def _accept(self, time: float, found: Followed, length: float) -> None:
        assert self._last is not None
        motion = (found.line.points - self._last.points) / (time - self._since)
        fastest = FASTEST * found.line.length
        motion *= np.minimum(1.0, fastest / np.maximum(np.hypot(*motion.T), 1e-9))[:, None]
        # What was hidden only seems to have moved.
        motion[found.line.score < GOOD] = 0.0
        self._motion = 0.5 * (self._motion + motion)
        self._last, self._look, self._since = found.line, found.look, time
        self._lengths = [*(old for old in self._lengths if time - old[0] < REMEMBERED), (time, length)]

    def _of_length(self, length: float, passed: float) -> bool:
        """Whether a line may be that long, m, as much time after the last one, s."""
        known = -SHORTER < length / self._length - 1.0 < LONGER
        last, usual = self._lengths[-1][1], float(np.median([of for _, of in self._lengths]))
        # A bend that something in front cut short may be what it was before, at once.
        return known and (length < (1.0 + DETOUR + DETOUR_RATE * passed) * last or abs(length / usual - 1.0) < DETOUR)

    def _metres(self, line: Centreline) -> float:
        curve = self._mapping.to_robot(line.points)
        return float(np.linalg.norm(np.diff(curve, axis=0), axis=1).sum())

    def _without_rest(self, line: Centreline) -> Centreline:
        """The line up to the held end: what goes on behind it is no strip."""
        curve = self._mapping.to_robot(line.points)
        arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
        if arc[-1] <= self._longest:
            return line
        s = np.linspace(0.0, float(np.interp(self._longest, arc, line.arc)), len(line.points))
        values = {name: np.interp(s, line.arc, getattr(line, name)) for name in ("sd", "width", "score")}
        return replace(line, points=interpolated(line.points, line.arc, s), **values)

    def _complete(self, line: Centreline) -> Centreline:
        length, known = self._metres(line), self._longest / HELD
        if not any(line.open_ends) and length < CUT_SHORT * known:
            raise TrackingError(
                self._source,
                f"{length * 1e3:.0f} mm of the strip are seen, its length is {known * 1e3:.0f} mm",
                f"all of it, or at least {CUT_SHORT:.0%}, in the first frames",
                "is strip.length right? keep things that hide it out of the first frames",
            )
        return line

    def _held(self, line: Centreline, end: Array) -> Centreline:
        away = float(np.hypot(*(line.points[0] - end)))
        if away > DROPPED * line.length + 2.0 * float(np.median(line.width)):
            raise TrackingError(
                self._source,
                f"the strip is {away:.0f} px from where the gripper should hold it",
                "a strip held by its end",
                "did it slip? compare gripper.marker.offset with the gripper",
            )
        return line


def _joined_to(line: Centreline, end: Array) -> Centreline:
    """The line made longer, straight, up to where it is held: the gripper hides its end."""
    points, places = between(line.points, np.stack([end, line.points[-1]]), len(line.points))
    values = {name: np.interp(places, line.arc, getattr(line, name)) for name in ("sd", "width", "score")}
    return replace(line, points=points, **values)


def without(image: NDArray[np.uint8], marker: Array) -> NDArray[np.uint8]:
    """A copy of a picture in which the marker and its rim have the grey that is around them: they are no strip."""
    centre = marker.mean(axis=0)
    covered = np.zeros(image.shape, np.uint8)
    around = np.zeros(image.shape, np.uint8)
    for canvas, grown in ((covered, RIM), (around, 1.3 * RIM)):
        cv2.fillConvexPoly(canvas, np.rint(centre + grown * (marker - centre)).astype(np.int32), (1,))
    ring = (around > 0) & (covered == 0)
    cleared = image.copy()
    if ring.any():
        cleared[covered > 0] = int(np.median(image[ring]))
    return cleared
