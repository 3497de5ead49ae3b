"""The centreline of a strip in a picture, against drawn strips and yarn in photographs."""

from __future__ import annotations

import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image
from scipy.interpolate import CubicHermiteSpline
from scipy.ndimage import map_coordinates

import drawn_strips as drawn
from oracles import sections as oracle
from stripfold import elastica
from stripfold.base.errors import InvalidInputError, TrackingError
from stripfold.film import cross_sections as sections
from stripfold.film import pictures, segmentation, smoothing
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


@pytest.mark.parametrize(("height", "leaves"), [(8, True), (18, False)])
def test_what_holds_the_end_up_to_the_border_is_not_a_strip_that_leaves_the_picture(height: int, leaves: bool) -> None:
    """A clamp as dark as the strip, which is 8 pixels wide, over the last 40 pixels."""
    image = np.full((200, 480), 160, np.uint8)
    image[96:104, 60:] = image[100 - height // 2 : 100 + height // 2, 440:] = 20
    found = find(cv2.GaussianBlur(image, (0, 0), 1.0))
    assert found.points[-1, 0] > 477.0
    assert found.open_ends == (False, leaves)


def test_same_from_either_end_and_without_a_start(line: Centreline) -> None:
    image = drawn.picture(SHARES["hook", 6.0])
    other = find(image, CURVES["hook"][-1])
    np.testing.assert_allclose(other.points[::-1], line.points, atol=0.6)
    left = find(image)
    assert left.points[0, 0] < left.points[-1, 0]
    np.testing.assert_allclose(left.reversed().points[::-1], left.points)


def test_start_within_the_strip_leaves_out_the_rest() -> None:
    curve = CURVES["arc"]
    found = find(drawn.picture(SHARES["arc", 6.0]), curve[200])
    assert found.length == pytest.approx(drawn.length(curve[200:]), abs=1.5)


def test_found_through_a_run_until_the_sag_comes_close() -> None:
    """Where the layers are about to touch only the picture before tells them apart."""
    worst, scaled = 0.0, []
    for i, state in enumerate([state for state in STATES[::3] if state.clearance * 33.0 > 12.0]):
        curve = drawn.hook(state, 33.0, 340.0, 600.0, 14.5)
        image = drawn.picture(drawn.coverage(curve, 5.0, SIZE), i)
        line = find(image, curve[0])
        off = drawn.errors(line.points, curve)
        worst = max(worst, float(np.abs(off).max()))
        scaled.append(off / line.sd)
        assert np.hypot(*(line.points[0] - curve[0])) < 2.0
        assert line.length == pytest.approx(drawn.length(curve), abs=3.0)
    assert worst < 0.6
    assert 0.7 < np.std(np.concatenate(scaled)) < 1.4


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


def test_pieces_are_joined_across_gaps_between_their_ends_only() -> None:
    strip = np.column_stack([np.linspace(0.0, 100.0, 101), np.zeros(101)])
    assert segmentation._gap(strip, strip + np.array([130.0, 2.0]), 6.0) == pytest.approx(30.0, abs=0.2)
    assert segmentation._gap(strip, strip + np.array([95.0, 3.0]), 6.0) == np.inf
    assert segmentation._gap(strip, strip + np.array([130.0, 60.0]), 6.0) == np.inf


def test_pieces_are_joined_across_a_tight_bend_but_not_across_a_step() -> None:
    """Two quarters of a circle of 25 pixels, an eighth of it apart, and the second one mirrored at the chord."""
    before, after = (
        25.0 * np.column_stack([np.cos(angle), np.sin(angle)])
        for angle in (np.linspace(-np.pi / 2.0, 0.0, 40), np.linspace(np.pi / 4.0, np.pi * 0.75, 40))
    )
    step = after[0] - before[-1]
    assert segmentation._gap(before, after, 5.0) == pytest.approx(np.hypot(*step))
    assert segmentation._gap(after[::-1], before[::-1], 5.0) == pytest.approx(np.hypot(*step))
    mirrored = after[0] + 2.0 * ((after - after[0]) @ step)[:, None] * step / (step @ step) - (after - after[0])
    assert segmentation._gap(before, mirrored, 5.0) == np.inf


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


def test_mask_includes_dim_parts() -> None:
    """A strip lit three times as bright at one end as at the other; Otsu's threshold of the whole loses half."""
    share = SHARES["arc", 6.0]
    lit = 20.0 + share * np.linspace(60.0, 235.0, SIZE[0])
    image = np.clip(lit + np.random.default_rng(0).normal(0.0, 3.0, share.shape), 0, 255).astype(np.uint8)
    found, _ = segmentation.foreground(image, bright=True)
    assert np.mean(found[share > 0.9]) > 0.98
    assert np.mean(found[share == 0.0]) < 0.02


@pytest.mark.parametrize("count", [1, 2, 7, 8])
def test_median_is_that_of_numpy(count: int) -> None:
    values = np.random.default_rng(count).normal(size=count)
    assert smoothing.median(values) == float(np.median(values))


def test_smoothing_halves_a_wave_at_its_cutoff_and_gives_its_variance() -> None:
    n, cutoff = 401, 20.0
    wave = np.cos(2.0 * np.pi * np.arange(n) / cutoff)[:, None]
    halved = smoothing.smoothed(wave, np.ones(n), cutoff)
    np.testing.assert_allclose(halved[150:250], 0.5 * wave[150:250], atol=0.01)
    noise = np.random.default_rng(1).normal(size=(n, 400))
    values = smoothing.smoothed(noise, np.ones(n), cutoff)
    variance = smoothing.variances(np.ones(n), cutoff)
    # The variance a posteriori: a sixth more than that of the noise alone, for this penalty.
    ratio = variance[50:-50] / np.var(values[50:-50], axis=1)
    assert 1.1 < ratio.mean() < 1.3
    weights = np.ones(n)
    weights[180:221] = 0.0
    gap = smoothing.variances(weights, cutoff)
    assert gap[200] > 20.0 * gap[100]


def test_bands_of_different_widths_together_and_alone() -> None:
    """Something dark in the wide sections beside the narrow bands, beyond where these are looked for."""
    t = np.arange(-30, 31, dtype=np.float64)
    widths = np.array([3.0, 3.0, 8.0, 20.0])
    centres = np.array([0.3, -0.4, 0.7, -1.2])
    clear = np.clip(0.5 * (0.5 * widths[:, None] + 1.0 - np.abs(t - centres[:, None])), 0.0, 1.0)
    bands = (40.0 + 160.0 * clear).astype(np.float32)
    for row, width in enumerate(widths):
        bands[row, np.abs(t) > sections.search_range(width) + 1] = 0.0
    bands[1, t == 6.0] = 120.0  # a thread beside a thin strip, in sight but no part of it
    together = sections.measure_edges(bands, widths)
    # Thin ones by their centroid.
    assert np.all(np.abs(together.offset - centres) < [0.1, 0.1, 0.01, 0.01])
    np.testing.assert_allclose(together.width, widths, atol=0.05)
    np.testing.assert_allclose(together.contrast, 160.0, atol=0.5)
    assert together.found.all()
    for row, width in enumerate(widths):
        own = slice(30 - int(sections.search_range(width)), 31 + int(sections.search_range(width)))
        alone = sections.measure_edges(bands[[row], own], float(width))
        for values, one in zip(together, alone, strict=True):
            np.testing.assert_allclose(values[row], one[0], atol=1e-4)
    # Where no edge is within sight, none is found beyond it.
    bands[0, np.abs(t) <= sections.search_range(3.0)] = 200.0
    assert not sections.measure_edges(bands, widths).found[0]


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


@pytest.mark.parametrize(("free", "end"), [(10, (406, 2592)), (15, (327, 2496)), (20, (137, 2129)), (25, (20, 2398))])
def test_hairy_yarn_from_border_to_end(images: Path, free: int, end: tuple[int, int]) -> None:
    """``end``: where the yarn ends, read off the pictures by eye."""
    line = find(pictures.read_grey(images / "yarn_bending" / f"acrylic_{free}_1.jpg"))
    assert line.open_ends == (True, False)
    assert line.points[0, 0] < 3.0
    assert np.hypot(*(line.points[-1] - end)) < 0.5 * np.median(line.width)
    assert np.mean(line.score > 0.8) > 0.6


def test_compiled_edges_are_those_of_numpy() -> None:
    rng = np.random.default_rng(8)
    width = np.repeat([1.0, 2.0, 4.0, 5.0, 9.3, 14.0], 40)
    t = np.arange(-30, 31)
    band = 1.0 / (1.0 + np.exp(2.0 * (np.abs(t - rng.uniform(-12.0, 12.0, (240, 1))) - 0.5 * width[:, None])))
    profiles = (60.0 + 120.0 * band + rng.normal(0.0, 3.0, band.shape)).astype(np.float32)
    found = sections.measure_edges(profiles, width)
    expected = oracle.edges(profiles, width)
    assert 0.3 < found.found.mean() < 1.0
    np.testing.assert_array_equal(found.found, expected[4])
    np.testing.assert_allclose(np.array(found[:4]), expected[:4], atol=2e-5)


@pytest.mark.parametrize("size", [7, 24, 150])
def test_compiled_smoothing_solves_its_equations(size: int) -> None:
    rng = np.random.default_rng(size)
    values, weights, cutoff = rng.normal(size=(size, 2)), rng.uniform(0.0, 1.0, size), 12.0
    third = np.diff(np.eye(size), 3, axis=0)
    matrix = np.diag(weights + 1e-9) + (cutoff / (2.0 * np.pi)) ** 6 * third.T @ third
    expected = np.linalg.solve(matrix, weights[:, None] * values)
    np.testing.assert_allclose(smoothing.smoothed(values, weights, cutoff), expected, atol=1e-9)
    np.testing.assert_allclose(smoothing.smoothed(values[:, 0], weights, cutoff), expected[:, 0], atol=1e-9)
    np.testing.assert_allclose(smoothing.variances(weights, cutoff), np.diag(np.linalg.inv(matrix)), rtol=1e-7)


def test_curve_through_points() -> None:
    points = CURVES["hook"][:: len(CURVES["hook"]) // 30]
    arc = sections.arc_length(points)
    np.testing.assert_allclose(arc[1:], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)), rtol=1e-14)
    s = np.linspace(0.0, arc[-1], 301)
    spline = CubicHermiteSpline(arc, points, np.gradient(points, arc, axis=0))
    np.testing.assert_allclose(sections.resampled(points, s), spline(s), atol=1e-10)
    step = np.gradient(points, axis=0)
    expected = step / np.linalg.norm(step, axis=1)[:, None]
    np.testing.assert_allclose(sections.tangents(points), expected, atol=1e-14)


@pytest.mark.parametrize("bright", [True, False])
def test_grey_values_across_a_curve(bright: bool) -> None:
    """Between pixels, also of sections that leave the picture, and 0 beyond the reach of each."""
    random = np.random.default_rng(3)
    image = random.integers(0, 256, (60, 80)).astype(np.uint8)
    image.setflags(write=False)
    points = random.uniform(-8.0, 88.0, (400, 2))
    across = sections.normals(random.normal(size=(400, 2)))
    reach = random.integers(1, 13, 400)
    t = np.arange(-12, 13)
    x, y = (points[:, k, None] + across[:, k, None] * t for k in range(2))
    expected = map_coordinates(image.astype(np.float64), [y, x], order=1, mode="nearest")
    expected = np.where(np.abs(t) <= reach[:, None], np.rint(expected if bright else 255.0 - expected), 0.0)
    np.testing.assert_allclose(sections.sample(image, points, across, reach, bright), expected, atol=1e-3)
