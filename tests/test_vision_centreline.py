"""The centreline of a strip in a picture, against drawn strips and yarn in photographs."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import drawn_strips as drawn
from stripfold import elastica
from stripfold.base.errors import InvalidInputError, TrackingError
from stripfold.film import cross_sections as sections
from stripfold.film import pictures
from stripfold.film.centreline import Centreline, find

SIZE = (640, 400)
LOOKS = {
    "sharp": {"blur": 0.8, "noise": 2.0},
    "noisy": {"blur": 1.5, "noise": 9.0},
    "dark": {"strip": 30.0, "ground": 150.0},
}


def hook(advance: float = 0.6, shift: float = 0.0) -> drawn.Array:
    """A state on the way from no horizontal force (0) to the critical point (1)."""
    return drawn.hook(STATES[round(advance * (len(STATES) - 1))], 33.0, 340.0, 600.0 + shift, 14.5)


def _states() -> list[elastica.State]:
    states = list(elastica.x_axis_branch(2.5, max_step=0.05))
    return states[: int(np.argmax([state.advance for state in states])) + 1]


STATES = _states()
CURVES = {"arc": drawn.arc(), "hook": hook()}
SHARES = {
    (name, width): drawn.coverage(curve, width, SIZE) for name, curve in CURVES.items() for width in (2.5, 6.0, 12.0)
}


@pytest.fixture(scope="module")
def line() -> Centreline:
    return find(drawn.picture(SHARES["hook", 6.0]), CURVES["hook"][0])


@pytest.mark.parametrize("look", LOOKS)
@pytest.mark.parametrize(("name", "width"), SHARES)
def test_strip_in_an_unknown_picture(name: str, width: float, look: str) -> None:
    curve = CURVES[name]
    found = find(drawn.picture(SHARES[name, width], **LOOKS[look]), curve[0])
    off = drawn.errors(found.points, curve)
    limit = {"sharp": 0.04, "noisy": 0.15, "dark": 0.06}[look]
    assert np.sqrt(np.mean(off**2)) < limit
    assert found.bright == (look != "dark")
    # From the gripper's end along the strip, both ends included.
    np.testing.assert_allclose(found.points[[0, -1]], curve[[0, -1]], atol=1.5)
    assert found.length == pytest.approx(drawn.length(curve), abs=1.5)
    steps = np.hypot(*np.diff(found.points, axis=0).T)
    np.testing.assert_allclose(steps, steps.mean(), rtol=0.02)
    if look == "sharp" and width > 4.0:
        assert np.median(found.width) == pytest.approx(width, abs=0.15)
    assert np.median(found.score) > 0.9


def test_uncertainty_matches_the_errors() -> None:
    pooled = []
    for seed, ((name, _), share) in enumerate(SHARES.items()):
        for look in LOOKS.values():
            found = find(drawn.picture(share, 50 + seed, **look), CURVES[name][0])
            pooled.append(drawn.errors(found.points, CURVES[name]) / found.sd)
    scaled = np.concatenate(pooled)
    assert 0.7 < np.std(scaled) < 1.4
    assert np.mean(np.abs(scaled) < 1.96) > 0.88


def test_first_point_is_next_to_the_gripper() -> None:
    way = CURVES["hook"][61] - CURVES["hook"][60]
    start = CURVES["hook"][60] + 4.0 * np.array([-way[1], way[0]]) / np.hypot(*way)
    found = find(drawn.picture(SHARES["hook", 6.0], 2), start)
    assert np.hypot(*(found.points[0] - CURVES["hook"][60])) < 0.5
    assert found.length == pytest.approx(drawn.length(CURVES["hook"][60:]), abs=1.5)
    assert np.abs(drawn.errors(found.points, CURVES["hook"])).max() < 0.3


def test_hidden_part_is_uncertain() -> None:
    hidden = drawn.picture(SHARES["arc", 6.0])
    centre = CURVES["arc"][300].astype(int)
    hidden[centre[1] - 20 : centre[1] + 20, centre[0] - 18 : centre[0] + 18] = 60
    found = find(hidden)
    covered = np.all(np.abs(found.points - centre) < 14, axis=1)
    assert covered.sum() >= 3
    assert found.score[covered].max() < 0.4
    assert found.score[~covered].mean() > 0.9
    assert found.sd[covered].min() > 2.0 * np.median(found.sd[~covered])
    # In the middle of what is hidden: some hundredths of how far away the last sight of it is.
    assert found.sd[covered].max() > 0.3
    off = drawn.errors(found.points, CURVES["arc"])
    assert np.abs(off[~covered]).max() < 0.5
    assert np.abs(off / found.sd).max() < 5.0


@pytest.mark.parametrize("offset", [-0.4, 0.0, 0.7])
@pytest.mark.parametrize("width", [2.5, 8.0])
def test_edges_of_a_known_band(width: float, offset: float) -> None:
    """On one side lies the strip's own dimmer face."""
    t = np.arange(-18.0, 19.0)[:, None] + np.linspace(-0.5, 0.5, 201)
    values = np.where(t < offset, 30.0, 70.0 if width > sections.THIN else 30.0)
    values = np.where(np.abs(t - offset) < width / 2.0, 200.0, values).mean(axis=1)
    profile = np.convolve(np.pad(values, 1, mode="edge"), [0.25, 0.5, 0.25], "valid")
    edges = sections.measure_edges(np.tile(profile, (3, 1)).astype(np.float32), width)
    assert edges.found.all()
    np.testing.assert_allclose(edges.offset, offset, atol=0.06)
    if width > sections.THIN:
        np.testing.assert_allclose(edges.width, width, atol=0.15)
        np.testing.assert_allclose(edges.contrast, 130.0, atol=3.0)


def test_no_strip_is_an_error() -> None:
    empty = drawn.picture(np.zeros(SIZE[::-1]))
    with pytest.raises(TrackingError, match="frame 7: no strip was found"):
        find(empty, source="frame 7")
    with pytest.raises(TrackingError, match="no strip was found"):
        find(np.full((200, 300), 7, np.uint8))


def test_disc_is_no_strip() -> None:
    y, x = np.mgrid[:300, :400]
    disc = np.clip(60.5 - np.hypot(x - 200, y - 150), 0.0, 1.0)
    with pytest.raises(TrackingError, match="the strip was found along 0%"):
        find(drawn.picture(disc))


def saved(tmp_path: Path, array: np.ndarray, name: str = "strip.png", **options: object) -> Path:
    path = tmp_path / name
    Image.fromarray(array).save(path, **options)
    return path


def test_pictures(tmp_path: Path) -> None:
    grey = drawn.picture(SHARES["arc", 6.0])
    np.testing.assert_array_equal(pictures.read_grey(saved(tmp_path, grey)), grey)
    deep = saved(tmp_path, (grey.astype(np.uint16) * 257), "deep.png")
    np.testing.assert_array_equal(pictures.read_grey(deep), grey)
    exif = Image.Exif()
    exif[0x0112] = 6  # the camera was held upright
    turned = saved(tmp_path, grey, "turned.png", exif=exif)
    assert pictures.read_grey(turned).shape == grey.shape[::-1]


def claiming(png: bytes, side: int) -> bytes:
    """The same file, whose header says that it is ``side`` pixels wide and high."""
    header = b"IHDR" + side.to_bytes(4, "big") * 2 + png[24:29]
    return png[:12] + header + zlib.crc32(header).to_bytes(4, "big") + png[33:]


def test_unusable_pictures(tmp_path: Path) -> None:
    good = saved(tmp_path, drawn.picture(SHARES["arc", 6.0])).read_bytes()
    contents = {"cut.png": good[: len(good) // 2], "text.jpg": b"not a picture", "empty.png": b""}
    contents |= {"wide.png": claiming(good, 9000), "bomb.png": claiming(good, 200_000)}
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InvalidInputError, match=f"image = .*{name}.*at most 50 million pixels") as caught:
            pictures.read_grey(tmp_path / name)
        assert "9000 x 9000" in str(caught.value) or name != "wide.png"
    with pytest.raises(InvalidInputError, match="an existing file"):
        pictures.read_grey(tmp_path / "none.png")
    with pytest.raises(InvalidInputError, match="each side 32"):
        pictures.read_grey(saved(tmp_path, np.zeros((8, 100), np.uint8), "tiny.png"))
