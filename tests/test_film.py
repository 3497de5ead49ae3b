"""Films: what was written is decoded again."""

from __future__ import annotations

from pathlib import Path

import av
import matplotlib as mpl
import numpy as np
import pytest
from av.video.reformatter import ColorRange, Colorspace
from matplotlib.colors import to_rgb

import made_up
from stripfold.errors import InvalidInputError
from stripfold.plots import colours, readers
from stripfold.plots import film as module
from stripfold.plots.film import film, timing

FPS, SLOW, STATIC = 10, 0.5, 1.2
"""A short film: 1.2 s of statics and 2 s of fall at double speed, 2.2 s in all."""
SECONDS = STATIC + SLOW * made_up.SETTLE


def short(path: Path, **options) -> Path:
    given = {"fps": FPS, "slowdown": SLOW, "static_seconds": STATIC} | options
    return film(made_up.collapse(), path, **given)


def decode(path: Path) -> list[np.ndarray]:
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    return short(tmp_path_factory.mktemp("film") / "collapse.mp4")


def has(frame: np.ndarray, colour: str) -> bool:
    """Whether some dots are nearly of this colour: thin lines lose some of theirs in H.264."""
    return bool(np.any(np.abs(frame.astype(float) / 255.0 - to_rgb(colour)).max(axis=2) < 0.08))


class TestTiming:
    found = readers.collapse(made_up.collapse())

    def test_the_fall_at_a_constant_rate(self):
        times = timing(self.found, 3.0, 4.0)
        fall = times.clock[self.found.part("fall")]
        # Both static parts have 0.24 m of way: two seconds each.
        np.testing.assert_allclose(fall, 2.0 + 3.0 * self.found.time[self.found.part("fall")])
        assert times.clock[-1] == pytest.approx(2.0 + 6.0 + 2.0)

    def test_the_gripper_at_constant_speed(self):
        times = timing(self.found, 3.0, 4.0)
        for phase in ("before", "after"):
            part = self.found.part(phase)
            np.testing.assert_allclose(np.diff(self.found.advance[part]) / np.diff(times.clock[part]), 0.12)

    @pytest.mark.parametrize(("seconds", "expected"), [(5.0, 1), (2.0, 2), (0.5, 10), (1e-3, 100)])
    def test_a_short_fall_is_slowed_down(self, seconds, expected):
        data = made_up.collapse()
        data["time"] = data["time"] * seconds / made_up.SETTLE
        assert timing(readers.collapse(data)).slowdown == expected

    def test_frames(self):
        shown = timing(self.found, SLOW, STATIC).frames(30)
        assert len(shown) == 67
        np.testing.assert_allclose(np.diff(shown), 1.0 / 30.0)
        assert shown[-1] == pytest.approx(2.2)

    def test_between(self):
        times = timing(self.found, SLOW, STATIC)
        for t in (0.0, 0.31, 0.6, 0.95, 1.7, SECONDS):
            before, after, share = times.between(t)
            assert 0.0 <= share <= 1.0
            assert (1.0 - share) * times.clock[before] + share * times.clock[after] == pytest.approx(t)
            assert self.found.phase[before] == self.found.phase[after]
        assert times.between(float(times.clock[-1]))[1:] == (len(times.clock) - 1, 1.0)


class TestFilm:
    def test_what_browsers_play(self, made):
        with av.open(str(made)) as container:
            (stream,) = container.streams
            assert stream.codec_context.name == "h264"
            assert stream.pix_fmt == "yuv420p"
            assert stream.width == 1260
            assert stream.height % 2 == 0
            assert stream.average_rate == FPS
            assert abs(float(stream.duration * stream.time_base) - SECONDS) <= 1.001 / FPS
            assert "creation_time" not in container.metadata
        content = made.read_bytes()
        assert 0 < content.index(b"moov") < content.index(b"mdat")

    def test_frames(self, made):
        frames = decode(made)
        assert len(frames) == 23
        difference = np.abs(frames[0].astype(int) - frames[-1])
        assert np.count_nonzero(difference.max(axis=2) > 100) > 500
        # Statics to 0.6 s, fall to 1.6 s, statics to 2.2 s.
        red = [has(frame, colours.RED) for frame in frames]
        green = [has(frame, colours.GREEN) for frame in frames]
        assert red == [6 <= i <= 15 for i in range(23)]
        assert green == [i >= 16 for i in range(23)]
        assert all(has(frame, colours.PURPLE) for frame in frames)

    def test_colours_are_those_of_hdtv(self, made):
        with av.open(str(made)) as container:
            context = container.streams.video[0].codec_context
            assert (context.colorspace, context.color_range) == (Colorspace.ITU709, ColorRange.MPEG)
            frame = next(container.decode(video=0))
        luma = np.frombuffer(frame.planes[0], np.uint8).reshape(frame.height, -1)[:, : frame.width]
        assert luma[0, 0] == 235  # white
        blue = np.array(to_rgb(colours.PURPLE)) @ [0.2126, 0.7152, 0.0722]
        stage = module._Stage(readers.collapse(made_up.collapse()), SLOW)
        x, z = stage.gripper.axes.transData.transform((100.0 * (made_up.LAMBDA_0 - made_up.LENGTH / 2.0), 15.0))
        assert luma[frame.height - int(z), int(x)] == pytest.approx(16.0 + 219.0 * blue, abs=2.0)

    def test_axes_stay(self, made):
        frames = decode(made)
        # Left of the axes and under them are only numbers and names; a moved one would differ by 255.
        for region in (np.s_[100:, :105], np.s_[-115:, :]):
            for frame in frames[1:]:
                assert np.abs(frame[region].astype(int) - frames[0][region]).max() < 60

    def test_what_a_frame_shows(self):
        found = readers.collapse(made_up.collapse())
        stage = module._Stage(found, 2.0)
        first = made_up.COUNTS["before"]
        frame = stage.frame(first, first + 10, 0.5)
        assert frame.shape == (stage.size[1], stage.size[0], 3)
        np.testing.assert_allclose(
            np.array(stage.strip.get_data()).T, 50.0 * (found.states[first] + found.states[first + 10])
        )
        # 2 s (10 / 40)^2 is an eighth of a second; half way there.
        assert stage.said.get_text() == "fall, slowed down 2 times: $t$ = 0.06 s"
        assert stage.position.get_text() == r"$\lambda$ = 36.0 cm"
        assert stage.critical.get_visible()
        np.testing.assert_allclose(np.transpose(stage.critical.get_data()), 100.0 * found.states[found.critical])
        (way,) = [line for line in stage.critical.axes.lines if line.get_linestyle() == ":"]
        np.testing.assert_allclose(np.transpose(way.get_data()), 100.0 * found.states[:, 0])
        assert [one.get_color() for one in (stage.strip, stage.said)] == [colours.RED, colours.RED]
        stage.frame(0, 15, 1.0)
        assert stage.said.get_text() == "static"
        assert stage.position.get_text() == r"$\lambda$ = 24.0 cm"
        assert not stage.critical.get_visible()
        assert [one.get_color() for one in (stage.strip, stage.said)] == [colours.BLACK, colours.BLACK]

    @pytest.mark.parametrize(
        ("slowdown", "text"), [(1.0, "real time"), (5.0, "slowed down 5 times"), (0.5, "sped up 2 times")]
    )
    def test_pace(self, slowdown, text):
        assert module._pace(slowdown) == text

    def test_same_bytes_whatever_the_user_has_set(self, made, tmp_path):
        with mpl.rc_context({"font.size": 30.0, "lines.linewidth": 7.0, "axes.facecolor": "red"}):
            before = dict(mpl.rcParams)
            again = short(tmp_path / "again.mp4")
            assert dict(mpl.rcParams) == before
        assert again.read_bytes() == made.read_bytes()

    def test_to_the_touch_only(self, tmp_path):
        data = made_up.collapse(after=False)
        path = film(data, tmp_path / "touch.mp4", fps=FPS, slowdown=2.0, static_seconds=0.5)
        assert len(decode(path)) == 16

    def test_progress(self, tmp_path):
        said: list[str] = []
        short(tmp_path / "film.mp4", progress=said.append)
        assert said == [f"drawing frame {i} of 23" for i in range(1, 24)]


class TestErrors:
    @pytest.mark.parametrize("name", ["film.avi", "film", "mp4", "film.mp4.part"])
    def test_suffix(self, tmp_path, name):
        with pytest.raises(InvalidInputError, match=r"\.mp4"):
            short(tmp_path / "new" / name)
        assert not list(tmp_path.iterdir())

    @pytest.mark.parametrize("key", ["fps", "slowdown", "static_seconds"])
    @pytest.mark.parametrize("value", [0, -1, float("nan"), float("inf")])
    def test_numbers(self, tmp_path, key, value):
        with pytest.raises(InvalidInputError, match=f"{key} = .* positive"):
            short(tmp_path / "new" / "film.mp4", **{key: value})
        assert not list(tmp_path.iterdir())

    def test_other_data(self, tmp_path):
        with pytest.raises(InvalidInputError, match="without phase"):
            film(made_up.collapse().drop_vars("phase"), tmp_path / "new" / "film.mp4")
        assert not list(tmp_path.iterdir())

    def test_interrupted_leaves_the_old_film(self, tmp_path):
        path = tmp_path / "film.mp4"
        path.write_bytes(b"old")

        def stop(text: str) -> None:
            # Late: the encoder looks ahead, and before it has written something there is nothing to spoil.
            if text == "drawing frame 67 of 67":
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            short(path, fps=30, progress=stop)
        assert path.read_bytes() == b"old"
        assert [one.name for one in tmp_path.iterdir()] == ["film.mp4"]
