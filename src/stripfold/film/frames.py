"""A frame of a recording, and what was irregular while all of them were read."""

from __future__ import annotations

from dataclasses import dataclass

from stripfold.base.arrays import Picture

MAX_MISSING = 0.05
"""Share of a video's length that may be missing at its end; a recorder may count another stream, or the last frame."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame.

    ``index``: from 0, in the order of presentation.  ``time``: when it was taken, s, by the camera's clock.  ``image``:
    shape (h, w): grey from 0, black, to 255, white; read-only.  ``doubled``: whether it repeats the frame before, pixel
    by pixel, with another time.  ``damaged``: whether a part of its data, or of a frame that it is predicted from, is
    missing.
    """

    index: int
    time: float
    image: Picture
    doubled: bool = False
    damaged: bool = False


@dataclass
class VideoReport:
    """Statistics of the reading: numbers of frames, and packets that could not be decoded.

    ``declared`` is the number of frames by the header, ``duration`` its length, s; 0 where it does not say.
    ``predicted`` says whether frames are compressed, with loss, by prediction from others, ``end`` is the time of the
    last one, s; ``coloured`` whether the first one has colours.
    """

    declared: int = 0
    duration: float = 0.0
    predicted: bool = False
    end: float = 0.0
    decoded: int = 0
    damaged: int = 0
    interlaced: int = 0
    coloured: bool = False
    errors: int = 0

    @property
    def truncated(self) -> bool:
        """Whether the video ends well before its header says, once it was read to its end."""
        return self.end * (1.0 + 1.0 / max(self.decoded, 1)) < (1.0 - MAX_MISSING) * self.duration

    @property
    def problems(self) -> tuple[str, ...]:
        """Each in words, for a video that was read to its end."""
        found = {
            f"the header declares {self.declared} frames, {self.decoded} were decoded": (
                self.declared not in (0, self.decoded)
            ),
            f"{self.errors} packets could not be decoded": self.errors > 0,
            f"{self.damaged} frames are damaged": self.damaged > 0,
            f"{self.interlaced} frames are interlaced: their odd rows were taken at another time": self.interlaced > 0,
        }
        return tuple(text for text, holds in found.items() if holds)
