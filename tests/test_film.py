"""Films: what was written is decoded again."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest
from matplotlib.colors import to_rgb

import made_up
import stripfold as sf
from stripfold.ask.assess import PathAssessment
from stripfold.base.errors import InvalidInputError
from stripfold.draw import colours, readers
from stripfold.draw import film as module
from stripfold.draw.film import clock, film, frames
from stripfold.draw.style import styled

FPS, SLOW, STATIC = 10, 0.5, 1.2
"""A short film: 1.2 s of statics and 2 s of fall at double speed, 2.2 s in all."""
FOUND = readers.collapse(made_up.collapse())
FALL = FOUND.part("fall")


def decode(path: Path) -> list[np.ndarray]:
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def has(frame: np.ndarray, colour: str) -> bool:
    """True where some dots are nearly of this colour: thin lines lose some of theirs in H.264."""
    wanted = (255.0 * np.array(to_rgb(colour))).astype(int)
    return bool(np.any(np.abs(frame[::2, ::2].astype(int) - wanted).max(axis=2) < 20))


class TestTiming:
    def test_fall_at_a_constant_rate_statics_at_constant_speed(self):
        times = clock(FOUND, 3.0)
        # Both static parts have 0.24 m of way: 0.6 s each.
        np.testing.assert_allclose(times[FALL], 0.6 + 3.0 * FOUND.time[FALL])
        assert times[-1] == pytest.approx(0.6 + 6.0 + 0.6)
        for phase in ("before", "after"):
            part = FOUND.part(phase)
            np.testing.assert_allclose(np.diff(FOUND.advance[part]) / np.diff(times[part]), 0.4)

    def test_frames(self):
        times = clock(FOUND, SLOW)
        shown = frames(times)
        assert len(shown) == 23
        assert shown[-1] == len(times) - 1
        np.testing.assert_allclose(np.interp(shown, np.arange(len(times)), times), np.arange(23) / FPS, atol=1e-12)
        # No frame lies between two phases.
        before = np.minimum(shown.astype(int), len(times) - 2)
        between = shown > before
        assert np.all(FOUND.phase[before[between]] == FOUND.phase[before[between] + 1])


class TestFilm:
    @styled
    def test_what_a_frame_shows(self):
        stage = module._Stage(FOUND, 2.0, "𝜆 =")
        first = made_up.COUNTS["before"]
        frame = stage.frame(first + 9.5)
        assert frame.shape == (stage.size[1], stage.size[0], 4)
        states = 100.0 * FOUND.states
        np.testing.assert_allclose(np.transpose(stage.strip.get_data()), 0.5 * (states[first + 9] + states[first + 10]))
        # Times are 2 s (i / 40)^2.
        assert stage.said.get_text() == "fall, slowed down 2 times: 𝑡 = 0.11 s"
        assert stage.position.get_text() == "𝜆 = 36.0 cm"
        assert stage.critical.get_visible()
        np.testing.assert_allclose(np.transpose(stage.critical.get_data()), states[FOUND.critical])
        (way,) = [line for line in stage.critical.axes.lines if line.get_linestyle() == ":"]
        np.testing.assert_allclose(np.transpose(way.get_data()), states[:, 0])
        assert [one.get_color() for one in (stage.strip, stage.said)] == [colours.RED, colours.RED]
        stage.frame(15.0)
        assert stage.said.get_text() == "static"
        assert stage.position.get_text() == "𝜆 = 24.0 cm"
        assert not stage.critical.get_visible()
        assert [one.get_color() for one in (stage.strip, stage.said)] == [colours.BLACK, colours.BLACK]

    @pytest.mark.parametrize(("slowdown", "text"), [(1.0, "real time"), (5.0, "slowed down 5 times")])
    def test_pace(self, slowdown, text):
        assert module._pace(slowdown) == text

    def test_to_the_touch_only(self, tmp_path):
        path = film(made_up.collapse(after=False), tmp_path / "touch.mp4")
        assert len(decode(path)) == 16


class TestErrors:
    @pytest.mark.parametrize("name", ["film.avi", "film", "mp4", "film.mp4.part"])
    def test_suffix(self, tmp_path, name):
        with pytest.raises(InvalidInputError, match=r"\.mp4"):
            film(made_up.collapse(), tmp_path / "new" / name)
        assert not list(tmp_path.iterdir())

    def test_other_data(self, tmp_path):
        with pytest.raises(InvalidInputError, match="without phase"):
            film(made_up.collapse().drop_vars("phase"), tmp_path / "new" / "film.mp4")
        assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def assessed() -> PathAssessment:
    strip = sf.Strip(length=0.36, eta_b=3780)
    return strip.assess(sf.paths.triangular(strip), fall=True, model="rod")


class TestOfAPath:
    """A film of an assessment."""

    def test_it_can_be_watched(self, assessed, tmp_path):
        assessed.film(tmp_path / "path.mp4")
        seen = decode(tmp_path / "path.mp4")
        assert has(seen[0], colours.BLACK)
        assert not has(seen[0], colours.FALLING)
        assert any(has(frame, colours.FALLING) for frame in seen)
        assert has(seen[-1], colours.SETTLED)

    def test_without_a_fall(self, tmp_path):
        strip = sf.Strip(length=0.3, eta_b=3780)
        strip.assess(sf.paths.low(strip, 0.036), model="rod").film(tmp_path / "path.mp4")
        assert not any(has(frame, colours.FALLING) for frame in decode(tmp_path / "path.mp4"))
