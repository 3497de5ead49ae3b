"""The pictures of a report: the film with what was detected, and frames around the snap."""

from __future__ import annotations

import base64
import io
from fractions import Fraction
from typing import NamedTuple

import av
import cv2
import numpy as np
from av.video.stream import VideoStream

from stripfold.base.arrays import Array, Index, Picture
from stripfold.film.measurement import Measurement

WIDTH, TILE = 480, 400
"""Largest width of the film, and width of a frame in the montage, pixels."""
MONTAGE_TIMES = (-0.5, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.5)
"""Times from the onset in the montage, s; stretched for a slow snap, so that the last but one shows its peak."""
MARGIN = 0.08
"""Room around the strip in the montage, as a share of its width."""
_ENCODING = {"crf": "26", "preset": "veryfast", "threads": "1", "subq": "1", "me_method": "dia", "trellis": "0"}
_RED, _BLUE = (0, 0, 212), (178, 114, 0)  # BGR

Box = tuple[int, int, int, int]
"""Left, top, right, bottom, pixels."""


class Pictures(NamedTuple):
    """In base64: the film, mp4; its frame at the onset, and frames around it with their times in words, JPEG."""

    film: str
    poster: str
    montage: list[tuple[str, str]]


def pictures(found: Measurement) -> Pictures:
    """The film and the frames around the onset, with the strip and its gripped end drawn in."""
    kept = found.tracks.thumbnails
    frames = np.arange(0, len(found.tracks.timing.time), kept.every)
    times = found.tracks.timing.time[frames] - found.event_time
    peak = found.motion.t[found.motion.peak] - found.event_time
    asked = max(1.0, peak / MONTAGE_TIMES[-2]) * np.array(MONTAGE_TIMES)
    chosen = sorted({int(np.argmin(np.abs(times - at))) for at in asked})
    onset = int(np.argmin(np.abs(times)))
    box, montage, poster = _strip_box(found, frames[chosen]), [], ""
    tile = TILE, round(TILE * (box[3] - box[1]) / (box[2] - box[0]))
    whole, size = (0, 0, *kept.size), _film_size(*kept.size)
    rate = Fraction(1.0 / (found.tracks.timing.period * kept.every)).limit_denominator(1000)
    film = io.BytesIO()
    with av.open(film, "w", format="mp4") as container:
        stream: VideoStream = container.add_stream("libx264", rate=rate, options=_ENCODING)
        stream.width, stream.height = size
        stream.pix_fmt = "yuv420p"
        for k, (frame, small) in enumerate(zip(frames.tolist(), kept.pictures, strict=True)):
            picture = _annotated(found, frame, small, whole, size)
            planes = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2YUV_I420), dtype=np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(planes, format="yuv420p")))
            if k == onset:
                poster = _jpeg(picture)
            if k in chosen:
                montage.append((f"{times[k]:+.2f} s", _jpeg(_annotated(found, frame, small, box, tile))))
        container.mux(stream.encode())
    return Pictures(base64.b64encode(film.getvalue()).decode(), poster, montage)


def _film_size(width: int, height: int) -> tuple[int, int]:
    """Width and height of the film, even as the encoder needs them."""
    small = min(WIDTH, width) // 2 * 2
    return small, round(small * height / width / 2) * 2


def _strip_box(found: Measurement, chosen: Index) -> Box:
    """What to show of the small frames: the strip in all that are chosen, with some room."""
    tracks, size = found.tracks, found.tracks.thumbnails.size
    points = np.concatenate([tracks.points[chosen].reshape(-1, 2), tracks.gripped_end[chosen]])
    pixels = _small(found, points[np.isfinite(points).all(axis=1)])
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    room = MARGIN * (high[0] - low[0])
    left, top = np.maximum(low - room, 0.0).astype(int)
    right, bottom = np.minimum(high + room, size).astype(int)
    return int(left), int(top), max(int(right), int(left) + 2), max(int(bottom), int(top) + 2)


def _small(found: Measurement, points: Array) -> Array:
    """Pixels of the small frames where points, shape (n, 2), m, are."""
    scale = np.array(found.tracks.thumbnails.size) / found.tracks.size
    return scale * (found.calibration.mapping.to_pixels(points) + 0.5) - 0.5


def _annotated(found: Measurement, frame: int, small: Picture, box: Box, size: tuple[int, int]) -> Picture:
    """A part of a small frame in another size, with the strip and its gripped end."""
    tracks = found.tracks
    left, top, right, bottom = box
    part = cv2.resize(small[top:bottom, left:right], size, interpolation=cv2.INTER_LINEAR)
    picture = np.asarray(cv2.cvtColor(part, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    scale = np.array(size) / (right - left, bottom - top)

    def places(points: Array) -> Array:
        # OpenCV takes coordinates with three binary digits after the point.
        return np.rint(8.0 * (scale * (_small(found, points) - (left, top) + 0.5) - 0.5)).astype(np.int32)

    if np.isfinite(tracks.strip_time[frame]):
        cv2.polylines(picture, [places(tracks.points[frame])], False, _RED, 1, cv2.LINE_AA, 3)
    x, z = places(tracks.gripped_end[frame][None])[0]
    cv2.circle(picture, (int(x), int(z)), 32, _BLUE, 1, cv2.LINE_AA, 3)
    return picture


def _jpeg(picture: Picture) -> str:
    _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 85])
    return base64.b64encode(data.tobytes()).decode()
