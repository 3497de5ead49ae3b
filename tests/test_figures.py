"""Every result draws its figure, and every command with --plot writes one, without a warning."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from matplotlib.colors import to_rgb

import made_up
import stripfold as sf
from stripfold.base.errors import InvalidInputError
from stripfold.cli import main
from stripfold.draw import colours
from stripfold.draw.film import film
from stripfold.files import store

STRIP = sf.Strip(length=0.5, eta_b=3780.0)
LOW = sf.paths.low(STRIP, height=0.03)
RESULTS: dict[str, Callable[[], Any]] = {
    "a critical point": lambda: STRIP.critical(height=0.09, model="rod"),
    "a touch": lambda: STRIP.critical(height=0.04, model="elastica"),
    "a collapse": lambda: STRIP.collapse(height=0.09, model="rod"),
    "a path followed": lambda: STRIP.assess(LOW, model="rod"),
    "a fall on a path": lambda: STRIP.assess(sf.paths.triangular(STRIP), fall=True, model="rod"),
    "a map": STRIP.map,
    "a plan": lambda: sf.Strip(length=0.26, eta_b=3780.0).plan(eta_b_uncertainty=0.0, cores=1),
    "a path": lambda: LOW,
}


@pytest.mark.parametrize("name", RESULTS)
def test_a_result_draws_itself(name: str, tmp_path: Path):
    figure = RESULTS[name]().plot()
    figure.savefig(tmp_path / "figure.png")
    assert any(axes.has_data() for axes in figure.axes)
    assert all(axes.get_xlabel() for axes in figure.axes if axes.axison and axes.get_visible() and axes.lines)


def test_a_figure_is_the_same_file_again(tmp_path: Path):
    line = ["path", "triangular", "--length", "0.5", "--eta-b", "3780", "--csv", str(tmp_path / "path.csv"), "--quiet"]
    first, again = (tmp_path / f"{name}.png" for name in ("first", "again"))
    assert [main([*line, "--plot", str(file)]) for file in (first, again)] == [0, 0]
    assert first.read_bytes() == again.read_bytes()


def test_a_stored_collapse_draws_as_the_one_computed(tmp_path: Path):
    from stripfold.draw import collapse_curve

    file = tmp_path / "collapse.nc"
    RESULTS["a collapse"]().to_netcdf(file)
    assert collapse_curve.draw(store.read(file)).axes


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


@pytest.mark.slow
def test_an_assessed_path_can_be_watched(tmp_path: Path):
    strip = sf.Strip(length=0.36, eta_b=3780)
    strip.assess(sf.paths.triangular(strip), fall=True, model="rod").film(tmp_path / "path.mp4")
    seen = decode(tmp_path / "path.mp4")
    assert has(seen[0], colours.BLACK)
    assert not has(seen[0], colours.FALLING)
    assert any(has(frame, colours.FALLING) for frame in seen)
    assert has(seen[-1], colours.SETTLED)


@pytest.mark.slow
def test_a_collapse_to_the_touch_only_gives_the_same_file_again(tmp_path: Path):
    data = made_up.collapse(after=False)
    first, again = film(data, tmp_path / "touch.mp4"), film(data, tmp_path / "again.mp4")
    assert first.read_bytes() == again.read_bytes()
    assert not has(decode(first)[-1], colours.SETTLED)


def test_the_command_line_draws_a_film(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    data = RESULTS["a collapse"]().to_dataset()
    begin = int(np.flatnonzero(data.phase == "fall")[0])
    store.write(data.isel(state=slice(begin - 1, begin + 20)), tmp_path / "fall.nc", title="a fall")
    assert main(["film", str(tmp_path / "fall.nc"), "--output", str(tmp_path / "fall.mp4")]) == 0
    assert capsys.readouterr().out.split() == ["written", str(tmp_path / "fall.mp4")]
    seen = decode(tmp_path / "fall.mp4")
    assert len(seen) > 20
    assert has(seen[-1], colours.FALLING)


@pytest.mark.parametrize("name", ["film.avi", "film", "mp4", "film.mp4.part"])
def test_no_name_of_a_film(tmp_path: Path, name: str):
    with pytest.raises(InvalidInputError, match=r"\.mp4"):
        film(made_up.collapse(), tmp_path / "new" / name)
    assert not list(tmp_path.iterdir())


def test_data_that_are_no_collapse(tmp_path: Path):
    with pytest.raises(InvalidInputError, match="without phase"):
        film(made_up.collapse().drop_vars("phase"), tmp_path / "new" / "film.mp4")
    assert not list(tmp_path.iterdir())
