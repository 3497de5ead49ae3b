"""Small copies of the frames of a film, kept while it is measured: the report need not decode it again."""

from __future__ import annotations

import cv2
import numpy as np

from stripfold.base.arrays import Picture
from stripfold.film.frames import Frame

WIDTH = 640
"""Largest width, pixels."""
MAX_FRAMES = 450
"""Most frames: of a longer film every second, fourth, ... is kept."""


class Thumbnails:
    """Every :attr:`every`-th frame, from the first, its sides divided by :attr:`whole`.

    ``size`` is that of the film's frames, width and height.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        # By a whole number: any other takes ten times as long to average over.
        self.whole = -(-size[0] // WIDTH)
        self.size = size[0] // self.whole, size[1] // self.whole
        self.every = 1
        self.pictures: list[Picture] = []

    def add(self, frame: Frame) -> None:
        """Keep the next frame, if it is one of those to keep."""
        if frame.index % self.every:
            return
        if len(self.pictures) == MAX_FRAMES:
            self.pictures, self.every = self.pictures[::2], 2 * self.every
            if frame.index % self.every:
                return
        self.pictures.append(self.small(frame.image))

    def small(self, picture: Picture) -> Picture:
        """A small copy of a picture of the film's size."""
        return np.asarray(cv2.resize(picture, self.size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
