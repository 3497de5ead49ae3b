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
import stripfold as sf
from stripfold.ask.path_assessment import PathAssessment
from stripfold.base.errors import InvalidInputError
from stripfold.cli import main
from stripfold.draw import colours, readers
from stripfold.draw import film as module
from stripfold.draw.film import clock, film, frames, slowdown_of
from stripfold.draw.style import styled

FPS, SLOW, STATIC = 10, 0.5, 1.2
"""A short film: 1.2 s of statics and 2 s of fall at double speed, 2.2 s in all."""
FOUND = readers.collapse(made_up.collapse())
FALL = FOUND.part("fall")


@pytest.fixture(autouse=True, scope="module")
def short():
    with pytest.MonkeyPatch.context() as patch:
        for name, value in {"FPS": FPS, "SLOWDOWNS": (SLOW,), "STATIC_SECONDS": STATIC, "HASTE": 1.0}.items():
            patch.setattr(module, name, value)
        yield


def decode(path: Path) -> list[np.ndarray]:
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


@pytest.fixture(scope="module")
def made(tmp_path_factory, short) -> Path:
    return film(made_up.collapse(), tmp_path_factory.mktemp("film") / "collapse.mp4")


@pytest.fixture(scope="module")
def decoded(made) -> list[np.ndarray]:
    return decode(made)


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

    def test_what_hardly_moves_in_a_fall_is_shown_faster(self, monkeypatch):
        monkeypatch.setattr(module, "HASTE", 5.0)
        # It moves for a quarter of the time, and rests for the others.
        seconds = np.diff(clock(FOUND, 3.0)[FALL]) / np.diff(FOUND.time[FALL])
        assert seconds[0] == pytest.approx(3.0)
        assert seconds[-1] == pytest.approx(3.0 / 5.0)
        assert module._pace(0.5) == "2 times as fast"

    @pytest.mark.parametrize(("seconds", "expected"), [(13.0, 1), (8.0, 2), (1.5, 10), (1e-3, 100)])
    def test_a_short_fall_is_slowed_down(self, monkeypatch, seconds, expected):
        monkeypatch.setattr(module, "SLOWDOWNS", (1, 2, 5, 10, 20, 50, 100))
        data = made_up.collapse()
        data["time"] = data["time"] * seconds / made_up.SETTLE
        assert slowdown_of(readers.collapse(data)) == expected

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
    def test_what_browsers_play(self, made):
        with av.open(str(made)) as container:
            (stream,) = container.streams
            assert stream.codec_context.name == "h264"
            assert stream.pix_fmt == "yuv420p"
            assert stream.width == 1260
            assert stream.height % 2 == 0
            assert stream.average_rate == FPS
            assert abs(float(stream.duration * stream.time_base) - 2.2) <= 1.001 / FPS
            assert "creation_time" not in container.metadata
        content = made.read_bytes()
        assert 0 < content.index(b"moov") < content.index(b"mdat")

    def test_frames(self, decoded):
        assert len(decoded) == 23
        # Statics to 0.6 s, fall to 1.6 s, statics to 2.2 s.
        assert [has(frame, colours.RED) for frame in decoded] == [6 <= i <= 15 for i in range(23)]
        assert [has(frame, colours.GREEN) for frame in decoded] == [i >= 16 for i in range(23)]
        assert all(has(frame, colours.PURPLE) for frame in decoded[::5])

    def test_axes_stay(self, decoded):
        # Left of the axes and under them are only numbers and names; a moved one would differ by 255.
        for region in (np.s_[100:, :150], np.s_[-130:, :]):
            for frame in decoded[1:]:
                assert np.abs(frame[region].astype(int) - decoded[0][region]).max() < 60

    @styled
    def test_colours_are_those_of_hdtv(self, made):
        with av.open(str(made)) as container:
            context = container.streams.video[0].codec_context
            assert (context.colorspace, context.color_range) == (Colorspace.ITU709, ColorRange.MPEG)
            frame = next(container.decode(video=0))
        luma = np.frombuffer(frame.planes[0], np.uint8).reshape(frame.height, -1)[:, : frame.width]
        assert luma[0, 0] == 235  # white
        expected = np.array(to_rgb(colours.PURPLE)) @ [0.2126, 0.7152, 0.0722]
        stage = module._Stage(FOUND, SLOW, "𝜆 =")
        x, z = stage.gripper.axes.transData.transform((100.0 * (made_up.LAMBDA_0 - made_up.LENGTH / 2.0), 15.0))
        assert luma[frame.height - int(z), int(x)] == pytest.approx(16.0 + 219.0 * expected, abs=2.0)

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

    def test_same_bytes_whatever_the_user_has_set(self, made, tmp_path):
        said: list[str] = []
        with mpl.rc_context({"font.size": 30.0, "lines.linewidth": 7.0, "axes.facecolor": "red"}):
            before = dict(mpl.rcParams)
            again = film(made_up.collapse(), tmp_path / "again.mp4", progress=said.append)
            assert dict(mpl.rcParams) == before
        assert again.read_bytes() == made.read_bytes()
        assert said == [f"drawing: {100 * i // 23} %" for i in range(23)]

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

    def test_interrupted_leaves_the_old_film(self, monkeypatch, tmp_path):
        monkeypatch.setattr(module, "FPS", 30)
        path = tmp_path / "film.mp4"
        path.write_bytes(b"old")

        def stop(text: str) -> None:
            # Late: the encoder looks ahead, and before it has written something there is nothing to spoil.
            if text == "drawing: 98 %":
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            film(made_up.collapse(), path, progress=stop)
        assert path.read_bytes() == b"old"
        assert [one.name for one in tmp_path.iterdir()] == ["film.mp4"]


@pytest.fixture(scope="module")
def assessed() -> PathAssessment:
    strip = sf.Strip(length=0.36, eta_b=3780)
    return strip.assess(sf.paths.triangular(strip), fall=True, model="rod")


class TestOfAPath:
    """A film of an assessment."""

    def test_the_fall_is_between_the_static_states(self, assessed, tmp_path, monkeypatch):
        drawn = []
        monkeypatch.setattr(module, "draw", lambda found, *_, **__: drawn.append(found))
        assessed.film(tmp_path / "path.mp4")
        (found,) = drawn
        runs = [phase for i, phase in enumerate(found.phase) if i == 0 or phase != found.phase[i - 1]]
        assert runs == ["before", "fall", "after"]
        fall = found.part("fall")
        assert np.all(np.isnan(found.time) == (found.phase != "fall"))
        assert found.time[fall[0]] == 0.0
        assert np.all(np.diff(found.time[fall]) > 0.0)
        # One motion: no jump from the last static state into the fall, nor from rest to the next static one.
        moved = np.linalg.norm(np.diff(found.states, axis=0), axis=2).max(axis=1)
        assert max(moved[fall[0] - 1], moved[fall[-1]]) < 3e-3
        np.testing.assert_allclose(found.states[-1, 0], [0.18, 0.0], atol=1e-6)

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

    def test_a_wrong_name_is_found_before_anything_is_computed(self, tmp_path, monkeypatch, capsys):
        monkeypatch.chdir(tmp_path)
        line = ["--length", "0.36", "--eta-b", "3780"]
        assert main(["path", "triangular", *line, "--csv", "path.csv"]) == 0
        monkeypatch.setattr(PathAssessment, "of", None)
        assert main(["assess", "path.csv", *line, "--film", "path.avi"]) == 2
        assert "a name that ends in .mp4" in capsys.readouterr().err
