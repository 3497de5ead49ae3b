"""From what is seen to what a camera delivers: exposure, rolling shutter, light, blur, noise."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from stripfold.arrays import Array
from stripfold.synthetic.canvas import Grey
from stripfold.synthetic.history import History
from stripfold.synthetic.render import Renderer
from stripfold.synthetic.scene import Filming

Light = NDArray[np.float32]

WORD = "SYNTHETIC"
FLICKER = 100.0
"""Of lamps on 50 Hz, Hz."""
_STEP, _BAND_STEP, _PASSING_STEP = 0.7, 0.15, 0.6
"""How far the strip may move between partial exposures and between bands of rows, and a passing thing, pixels."""
_MOST_PARTS, _MOST_BANDS = 16, 32


@dataclass(frozen=True, eq=False)
class Timeline:
    """When frames are taken and which arrive.

    Attributes
    ----------
    t
        Shape (n,): time stamp of each frame that arrives, s.
    shown
        Shape (n,): when what it shows was filmed, s; earlier where a frame is doubled.
    dropped
        Shape (d,): times of the frames that do not arrive, s.
    """

    t: Array
    shown: Array
    dropped: Array


def timeline(filming: Filming, end: float, fall: float | None, tick: float, rng: np.random.Generator) -> Timeline:
    """Times of the frames of a film of ``end`` seconds, multiples of ``tick``; ``fall`` is where the snap begins, s."""
    period = 1.0 / filming.frame_rate
    t = np.arange(int(end / period) + 1) * period
    # Frames stay in their order, and the first is at 0.
    t[1:] += period * np.clip(filming.jitter * rng.standard_normal(len(t) - 1), -0.4, 0.4)
    t = np.rint(t / tick) * tick
    lost = rng.random(len(t)) < filming.dropped
    if fall is not None and filming.dropped_at_event:
        first = int(np.searchsorted(t, fall))
        lost[first : first + filming.dropped_at_event] = True
    doubled = (rng.random(len(t)) < filming.doubled) & ~lost
    lost[:2] = doubled[:2] = False
    shown = t.copy()
    for i in np.flatnonzero(doubled):
        shown[i] = shown[i - 1]
    return Timeline(t[~lost], shown[~lost], t[lost])


class Sensor:
    """What a camera makes of a scene.

    Parameters
    ----------
    renderer
        Draws the scene.
    span
        How long the film is, s: shadows and passing things cross the picture once in that time.
    rng
        For the noise.
    """

    def __init__(self, renderer: Renderer, span: float, rng: np.random.Generator) -> None:
        self._renderer, self._filming, self._span, self._rng = renderer, renderer.scene.filming, span, rng
        self._phase = rng.uniform(-0.2, 0.2)

    def film(self, history: History, times: Timeline) -> Iterator[Grey]:
        """The frames, shape (height, width) each; a doubled one is the one before again, to the bit."""
        last: tuple[float, Grey] | None = None
        for shown in times.shown:
            if last is None or last[0] != shown:
                last = float(shown), self.delivered(self.exposed(history, float(shown)), float(shown))
            yield last[1]

    def exposed(self, history: History, t: float) -> Light:
        """Shape (height, width), 255 for white in full light: the mean over the exposure of each row."""
        filming = self._filming
        width, height = filming.size
        pixel = filming.field / width
        shutter, exposure = filming.rolling_shutter, filming.exposure
        whole = history.displacement(t - 0.5 * exposure, t + shutter + 0.5 * exposure) / pixel
        moved = whole / (shutter + exposure) if shutter + exposure > 0.0 else 0.0
        # A passing thing is nothing to measure: its steps need only be too small to be seen.
        passing = 1.4 * width / self._span if filming.passing else 0.0
        fine = max(moved / _BAND_STEP, passing / _PASSING_STEP)
        bands = int(np.clip(np.ceil(fine * shutter), 1, _MOST_BANDS))
        parts = int(np.clip(np.ceil(moved * exposure / _STEP), 1, _MOST_PARTS))
        limits = np.rint(np.linspace(0, height, bands + 1)).astype(int)
        picture = np.empty((height, width), dtype=np.float32)
        for first, end in pairwise(limits.tolist()):
            middle = t + shutter * 0.5 * (first + end - 1) / (height - 1)
            moments = middle + exposure * ((np.arange(parts) + 0.5) / parts - 0.5)
            curves, grippers = history.at(moments)
            total = np.zeros((end - first, width), dtype=np.float32)
            for moment, curve, gripper in zip(moments, curves, grippers, strict=True):
                seen = self._renderer.picture(curve, gripper, self._passing(moment), (first, end))
                total += seen[first:end]
            picture[first:end] = total / parts
        return picture

    def delivered(self, seen: Light, t: float | None, free: Array | None = None) -> Grey:
        """What arrives, shape (height, width): under its light, out of focus, with noise, labelled.

        Parameters
        ----------
        seen
            Shape (height, width), 255 for white in full light.
        t
            When, s; None for a picture that was taken at rest, in steady light.
        free
            Shape (n, 2): pixels that the label keeps away from.
        """
        filming = self._filming
        light = seen * self._lighting(t)
        if filming.defocus > 0.0:
            blurred = cv2.GaussianBlur(light, (0, 0), filming.defocus, borderType=cv2.BORDER_REPLICATE)
            light = np.asarray(blurred, dtype=np.float32)
        noise = self._rng.standard_normal(light.shape, dtype=np.float32)
        spread = np.sqrt(filming.shot_noise**2 / 255.0 * light + np.float32(filming.read_noise**2))
        picture = np.asarray(np.clip(np.rint(light + spread * noise), 0, 255), dtype=np.uint8)
        return labelled(picture, free)

    def _lighting(self, t: float | None) -> Light:
        filming = self._filming
        width, height = filming.size
        x = np.arange(width, dtype=np.float32) / width
        across = filming.light * (1.0 + filming.gradient * (0.5 - x))
        down = np.ones(height, dtype=np.float32)
        if t is not None:
            rows = t + filming.rolling_shutter * np.arange(height) / (height - 1)
            down += (filming.flicker * np.sin(2.0 * np.pi * FLICKER * rows)).astype(np.float32)
            across *= 1.0 - filming.shadow * np.exp(-0.5 * ((x + 0.2 - 1.4 * self._share(t)) / 0.12) ** 2)
        return np.asarray(np.outer(down, across), dtype=np.float32)

    def _share(self, t: float) -> float:
        """Of the way across that a shadow or a passing thing has gone."""
        return t / self._span + self._phase

    def _passing(self, t: float) -> float | None:
        if not self._filming.passing:
            return None
        return self._filming.target[0] + self._filming.field * (1.4 * self._share(t) - 0.7)


def labelled(picture: Grey, free: Array | None = None) -> Grey:
    """A copy with the word synthetic in the lower right corner, or in that corner which is farthest from ``free``."""
    height, width = picture.shape
    scale = max(0.3, width / 1600.0)
    (long, high), _ = cv2.getTextSize(WORD, cv2.FONT_HERSHEY_PLAIN, 2.0 * scale, 1)
    corners = [(width - long - 3, height - 4), (3, height - 4), (width - long - 3, high + 3), (3, high + 3)]
    place = corners[0]
    if free is not None:
        middles = np.array([[x + 0.5 * long, y - 0.5 * high] for x, y in corners])
        gaps = np.linalg.norm(middles[:, None] - free[None], axis=2).min(axis=1)
        place = corners[int(np.argmax(gaps))]
    dark = float(picture[max(place[1] - high, 0) : place[1] + 1, place[0] : place[0] + long].mean()) < 128.0
    done = picture.copy()
    cv2.putText(done, WORD, place, cv2.FONT_HERSHEY_PLAIN, 2.0 * scale, 150 if dark else 60, 1, cv2.LINE_AA)
    return done
