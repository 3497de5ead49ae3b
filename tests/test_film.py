"""Films of collapses and paths: what is in their frames, and what is no film."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest
from matplotlib.colors import to_rgb

import made_up
import stripfold as sf
from stripfold.base.errors import InvalidInputError
from stripfold.draw import colours
from stripfold.draw.film import film


def decode(path: Path) -> list[np.ndarray]:
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        # What browsers play.
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def has(frame: np.ndarray, colour: str) -> bool:
    """True where some dots are nearly of this colour: thin lines lose some of theirs in H.264."""
    wanted = (255.0 * np.array(to_rgb(colour))).astype(int)
    return bool(np.any(np.abs(frame[::2, ::2].astype(int) - wanted).max(axis=2) < 20))


def test_an_assessed_path_can_be_watched(tmp_path: Path):
    strip = sf.Strip(length=0.36, eta_b=3780)
    strip.assess(sf.paths.triangular(strip), fall=True, model="rod").film(tmp_path / "path.mp4")
    seen = decode(tmp_path / "path.mp4")
    assert has(seen[0], colours.BLACK)
    assert not has(seen[0], colours.FALLING)
    assert any(has(frame, colours.FALLING) for frame in seen)
    assert has(seen[-1], colours.SETTLED)


def test_a_collapse_to_the_touch_only_gives_the_same_file_again(tmp_path: Path):
    data = made_up.collapse(after=False)
    first, again = film(data, tmp_path / "touch.mp4"), film(data, tmp_path / "again.mp4")
    assert first.read_bytes() == again.read_bytes()
    assert not has(decode(first)[-1], colours.SETTLED)


@pytest.mark.parametrize("name", ["film.avi", "film", "mp4", "film.mp4.part"])
def test_no_name_of_a_film(tmp_path: Path, name: str):
    with pytest.raises(InvalidInputError, match=r"\.mp4"):
        film(made_up.collapse(), tmp_path / "new" / name)
    assert not list(tmp_path.iterdir())


def test_data_that_are_no_collapse(tmp_path: Path):
    with pytest.raises(InvalidInputError, match="without phase"):
        film(made_up.collapse().drop_vars("phase"), tmp_path / "new" / "film.mp4")
    assert not list(tmp_path.iterdir())
