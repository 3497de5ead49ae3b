"""Synthetic films: what is drawn is where it should be, arrives when it should, and is lit and blurred as asked."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
import pytest

from stripfold.base.arrays import Array
from stripfold.film import video
from stripfold.film.boards import detect, dictionary
from stripfold.synthetic import render
from stripfold.synthetic.calibration import Calibration
from stripfold.synthetic.canvas import Canvas
from stripfold.synthetic.history import History
from stripfold.synthetic.recording import history_of
from stripfold.synthetic.render import Renderer
from stripfold.synthetic.scene import Filming, Scene
from stripfold.synthetic.sensor import Sensor
from stripfold.synthetic.video import encode, tick, timeline
from stripfold.synthetic.view import Rays, View, rotation_vector

# Only the strip's edge is lit, nothing is out of focus, nothing is noisy.
BARE = {"background": 0.0, "table": 0.0, "light": 1.0, "gradient": 0.0, "defocus": 0.0, "size": [320, 240]}
STILL = {**BARE, "shot_noise": 0.0, "read_noise": 0.0}
EDGE = {"grey": 0.0, "edge": 1.0, "texture": 0.0, "thickness": 2e-3}
FAR = np.array([0.0, 5.0])
"""A gripper out of the picture."""


def by_hand(view: View, points: Array) -> Array:
    """The pinhole camera with k1, k2, p1, p2, from its textbook; points x, z of the folding plane."""
    angle = float(np.linalg.norm(view.rotation))
    k = view.rotation / angle
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    rotation = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    seen = np.column_stack([points[:, 0], np.zeros(len(points)), points[:, 1]]) @ rotation.T + view.translation
    x, y = seen[:, 0] / seen[:, 2], seen[:, 1] / seen[:, 2]
    k1, k2, p1, p2, _ = view.camera.distortion
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2 * r2
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    matrix = view.camera.matrix
    return np.column_stack([matrix[0, 0] * u + matrix[0, 2], matrix[1, 1] * v + matrix[1, 2]])


def centroids(picture: Array, axis: int) -> Array:
    """Of the light along rows (axis 0) or columns (axis 1)."""
    places = np.arange(picture.shape[axis], dtype=float)
    weight = picture.sum(axis=axis)
    with np.errstate(invalid="ignore"):
        return np.tensordot(places, picture, (0, axis)) / weight


@pytest.mark.parametrize("behind", [False, True])
def test_the_edge_is_drawn_where_the_camera_sees_it(behind: bool) -> None:
    filming = {**STILL, "distortion": [-0.25, 0.1, 2e-3, -2e-3], "tilt": 6.0, "yaw": 5.0, "roll": 3.0, "behind": behind}
    scene = Scene(filming=filming, strip=EDGE)
    x = np.linspace(-0.03, 0.19, 100)
    curve = np.column_stack([x, 0.09 + 0.03 * np.sin(40.0 * x)])
    renderer = Renderer(scene, curve)
    picture = renderer.picture(curve, FAR).astype(float)
    dense = np.linspace(-0.03, 0.19, 20000)
    pixels = by_hand(renderer.view, np.column_stack([dense, 0.09 + 0.03 * np.sin(40.0 * dense)]))
    pixels = pixels[np.argsort(pixels[:, 0])]
    columns = np.arange(int(pixels[0, 0]) + 25, int(pixels[-1, 0]) - 25)
    error = centroids(picture, 0)[columns] - np.interp(columns, pixels[:, 0], pixels[:, 1])
    assert len(columns) > 150
    assert np.abs(error).max() < 0.05
    assert abs(error.mean()) < 0.005


def test_a_pixel_is_covered_by_its_exact_share() -> None:
    canvas = Canvas(np.full((12, 15), 100.0, dtype=np.float32))
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])

    def shares(low: tuple[float, float], high: tuple[float, float]) -> Array:
        """Of the pixels in a rectangle."""
        parts = []
        for n, a, b in zip((15, 12), low, high, strict=True):
            edges = np.arange(n + 1) - 0.5
            parts.append(np.clip(np.minimum(edges[1:], b) - np.maximum(edges[:-1], a), 0.0, None))
        return np.outer(parts[1], parts[0])

    outside = (
        ((-3.2, 2.3), (4.6, 30.0)),
        ((9.5, -5.0), (22.0, 3.25)),
        ((2.5, 3.5), (4.5, 7.5)),
        ((3.2, 1.1), (3.4, 1.3)),
    )
    for low, high in outside:
        for corners in (square, square[::-1]):
            canvas.clear()
            canvas.polygons((np.array(low) + corners[None] * np.subtract(high, low), 0.0))
            np.testing.assert_allclose(canvas.picture, 100.0 * (1.0 - shares(low, high)), atol=1e-3)
    # A slanted side, a layer within another, and what is beside and between the corners of the picture.
    canvas.clear()
    canvas.polygons((np.array([[[2.0, 1.0], [10.0, 5.0], [2.0, 9.0]]]), 0.0), (2.5 + square[None], 1.0))
    assert np.sum(100.0 - canvas.picture) == pytest.approx(100.0 * 32.0 - 255.0, rel=1e-5)
    canvas.clear()
    canvas.polygons((square[None] + [20.0, 3.0], 0.0), (square[None] + [-9.0, 3.0], 0.0))
    canvas.polygons((np.array([[[14.0, -9.0], [30.0, -9.0], [30.0, 7.0]]]), 0.0))
    assert np.all(canvas.picture == 100.0)


def test_a_ribbon_is_as_dark_as_its_pieces() -> None:
    canvas = Canvas(np.zeros((12, 15), dtype=np.float32))
    x = np.linspace(1.3, 12.9, 24)
    one, other = np.column_stack([x, 3.0 + 0.2 * x]), np.column_stack([x + 0.3, 6.0 + 0.25 * x])
    greys = np.linspace(0.2, 0.9, 23)
    pieces = np.stack([one[:-1], one[1:], other[1:], other[:-1]], axis=1)
    for turned in (False, True):
        canvas.clear()
        canvas.ribbon(*((other, one) if turned else (one, other)), greys)
        sums = np.zeros_like(canvas.picture)
        for piece, grey in zip(pieces, greys, strict=True):
            alone = Canvas(np.zeros((12, 15), dtype=np.float32))
            alone.polygons((piece[None], float(grey)))
            sums += alone.picture
        np.testing.assert_allclose(canvas.picture, sums, atol=1e-3)


def test_target_and_field_of_view() -> None:
    scene = Scene(filming={**STILL, "distortion": [0, 0, 0, 0], "tilt": 5.0, "yaw": 0.0, "field": 0.4})
    view = View.of(scene.filming)
    target = np.array(scene.filming.target)
    np.testing.assert_allclose(by_hand(view, target[None])[0], [159.5, 119.5], atol=1e-6)
    ends = by_hand(view, target + np.array([[-0.02, 0.0], [0.02, 0.0]]))
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(32.0, rel=2e-3)
    assert by_hand(view, target[None] + [0.0, 0.01])[0, 1] < 119.0
    assert view.place[1] < 0.0
    behind = View.of(Scene(filming={**STILL, "behind": True}).filming)
    assert behind.place[1] > 0.0


def test_rays_are_the_inverse_of_projection() -> None:
    wide = {**STILL, "distortion": [-0.3, 0.08, 2e-3, -2e-3], "distance": 0.25}
    view = View.of(Scene(filming=wide).filming)
    directions = Rays(view.camera, 2).directions.astype(float)
    assert directions.shape == (480, 640, 2)
    some = directions[::53, ::53].reshape(-1, 2)
    back = view.camera.project(np.column_stack([some, np.ones(len(some))]), np.zeros(3), np.zeros(3))
    columns, rows = np.meshgrid(np.arange(0, 640, 53), np.arange(0, 480, 53))
    np.testing.assert_allclose(back, np.column_stack([columns.ravel(), rows.ravel()]) / 2 - 0.25, atol=2e-3)


@pytest.mark.parametrize("kind", ["chessboard", "charuco"])
def test_boards_are_detected_where_they_are(kind: str) -> None:
    filming = {"size": [480, 360], "board": kind, "distortion": [-0.2, 0.05, 1e-3, -1e-3], "defocus": 0.8, "views": 5}
    calibration = Calibration(Renderer(Scene(filming=filming), np.eye(2)), np.random.default_rng(0))
    board, camera = calibration.board, calibration.renderer.view.camera
    poses = [*calibration.poses(), calibration.plane_pose()]
    assert len(poses) == 6
    reached, errors = [], []
    for pose in poses:
        found = detect(calibration.picture(pose), board)
        assert found is not None
        assert len(found.ids) > 30
        truth = camera.project(board.points + board.square * np.array([1, 1, 0]), rotation_vector(pose[0]), pose[1])
        error = found.pixels - truth[found.ids]
        if np.abs(error).max() > 10.0:  # a chessboard may be found from its other end
            error = found.pixels[::-1] - truth
        errors.append(error)
        reached.append(truth)
    assert max(np.sqrt(np.mean(np.sum(error**2, axis=1))) for error in errors) < 0.1
    assert np.abs(np.concatenate(errors).mean(axis=0)).max() < 0.03
    assert np.all(np.ptp(np.concatenate(reached), axis=0) > [0.7 * 480, 0.65 * 360])


def test_the_plane_board_and_the_stops_are_in_the_folding_plane() -> None:
    scene = Scene(filming={"size": [480, 360], "behind": True, "tilt": 6.0, "roll": 2.0, "stop_noise": 0.0})
    calibration = Calibration(Renderer(scene, np.eye(2)), np.random.default_rng(1))
    view = calibration.renderer.view
    rotation, translation = calibration.plane_pose()
    places = (calibration.outline @ rotation.T + translation - view.translation) @ view.matrix
    np.testing.assert_allclose(places[:, 1], 0.0, atol=1e-12)
    # A margin of 0.6 squares around 9 by 6 of them.
    sides = np.linalg.norm(np.diff(places, axis=0), axis=1)
    np.testing.assert_allclose(sides, calibration.board.square * np.array([10.2, 7.2, 10.2]))
    detector = cv2.aruco.ArucoDetector(dictionary(render.DICTIONARY))
    stops = calibration.stops()
    assert len(stops) == 9
    for place in stops:
        picture = calibration.renderer.picture(None, place + scene.gripper.offset).astype(np.uint8)
        corners, ids, _ = detector.detectMarkers(picture)
        assert ids.ravel().tolist() == [scene.gripper.marker]
        half = 0.5 * scene.gripper.marker_size
        # In the picture: upper left, upper right, and on; this camera sees x grow to the left.
        truth = by_hand(view, place + half * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]))
        assert np.linalg.norm(corners[0].reshape(4, 2) - truth, axis=1).max() < 1.5
        soft = cv2.GaussianBlur(picture, (0, 0), 0.8)
        fine = cv2.cornerSubPix(soft, truth.astype(np.float32).reshape(-1, 1, 2), (3, 3), (-1, -1), (3, 40, 1e-4))
        # Corners of one square lean outwards together: their mean does not.
        assert np.abs((fine.reshape(4, 2) - truth).mean(axis=0)).max() < 0.06


def moving(speed: float, seconds: float = 1.0) -> History:
    """An upright strip that moves along x."""
    t = np.linspace(0.0, seconds, 501)
    x = 0.05 + speed * t
    z = np.linspace(0.2, -0.03, 60)
    curve = np.stack([np.broadcast_to(x[:, None], (501, 60)), np.broadcast_to(z, (501, 60))], axis=-1)
    return History(t, np.column_stack([x, np.full(501, 5.0)]), curve, None, None, None)


def seen_moving(**filming: float) -> Array:
    """The strip of :func:`moving` at 0.25 m/s, one pixel per millimetre."""
    given = {**STILL, "exposure": 0.0, "tilt": 0.0, "distortion": [0, 0, 0, 0], **filming}
    history = moving(0.25)
    return sensor_of(given, history.curve[0], strip={**EDGE, "width": 1e-3}).exposed(history, 0.2).astype(float)


def sensor_of(filming: dict[str, Any], curve: Array | None = None, **scene: Any) -> Sensor:
    renderer = Renderer(Scene(filming=filming, **scene), np.eye(2) if curve is None else curve)
    return Sensor(renderer, 1.0, np.random.default_rng(0))


def test_a_history_is_interpolated() -> None:
    history = moving(0.3)
    curve, gripper = history.at(np.array([-1.0, 0.3331, 9.0]))
    np.testing.assert_allclose(gripper[:, 0], [0.05, 0.05 + 0.3 * 0.3331, 0.35], atol=1e-12)
    np.testing.assert_allclose(curve[:, 7, 0], gripper[:, 0], atol=1e-12)
    assert history.displacement(0.2, 0.3) == pytest.approx(0.03)


def test_rolling_shutter_shears() -> None:
    rows = np.arange(30, 190)
    upright, sheared = (centroids(seen_moving(rolling_shutter=s), 1)[rows] for s in (0.0, 0.03))
    slope = np.polyfit(rows, sheared - upright, 1)[0]
    assert slope == pytest.approx(250.0 * 0.03 / 239, rel=0.05)
    assert (sheared - upright)[0] == pytest.approx(slope * 30, abs=0.15)


def test_motion_blur_has_the_length_of_the_motion() -> None:
    still, blurred = (seen_moving(exposure=exposure)[100] for exposure in (0.0, 0.03))
    x = np.arange(320)
    at, now = (np.average(x, weights=row) for row in (still, blurred))
    narrow, wide = (np.average((x - c) ** 2, weights=row) for row, c in ((still, at), (blurred, now)))
    assert np.sqrt(12.0 * (wide - narrow)) == pytest.approx(250.0 * 0.03, rel=0.03)
    assert now == pytest.approx(at, abs=0.02)  # the time stamp is the middle of the exposure
    assert blurred.sum() == pytest.approx(still.sum(), rel=0.02)


def test_noise_and_light() -> None:
    sensor = sensor_of({**BARE, "shot_noise": 4.0, "read_noise": 2.0, "light": 0.8, "gradient": 0.2})
    for seen in (50.0, 200.0):
        picture = sensor.delivered(np.full((240, 320), seen, dtype=np.float32), None).astype(float)[:200]
        middle = picture[:, 150:170]
        assert middle.mean() == pytest.approx(0.8 * seen, rel=0.01)
        # The rounding to whole grey values adds a twelfth.
        variance = 4.0**2 * 0.8 * seen / 255.0 + 2.0**2 + 1.0 / 12.0
        assert middle.std() == pytest.approx(np.sqrt(variance), rel=0.04)
        assert picture[:, :8].mean() / picture[:, -8:].mean() == pytest.approx(1.1 / 0.9, rel=0.02)


def test_flicker_is_seen_in_the_rows_of_a_rolling_shutter() -> None:
    sensor = sensor_of({**STILL, "flicker": 0.2, "rolling_shutter": 0.02})
    picture = sensor.delivered(np.full((240, 320), 150.0, dtype=np.float32), 0.003).astype(float)
    rows = picture[:, :200].mean(axis=1) / 150.0
    expected = 1.0 + 0.2 * np.sin(2 * np.pi * 100.0 * (0.003 + 0.02 * np.arange(240) / 239))
    np.testing.assert_allclose(rows, expected, atol=0.01)


def test_dropped_doubled_and_late_frames() -> None:
    filming = Filming(frame_rate=50.0, dropped=0.1, doubled=0.1, dropped_at_event=3)
    times = timeline(filming, 20.0, 10.0, np.random.default_rng(0))
    together = np.sort(np.concatenate([times.t, times.dropped]))
    np.testing.assert_allclose(together, np.arange(1001) * 0.02, atol=1e-9)
    assert len(times.dropped) == pytest.approx(100, abs=30)
    assert {500, 501, 502} <= set(np.rint(times.dropped / 0.02).astype(int).tolist())
    doubled = times.shown < times.t
    assert doubled.sum() == pytest.approx(90, abs=30)
    late = timeline(Filming(frame_rate=50.0, jitter=0.1), 20.0, None, np.random.default_rng(0))
    assert np.std(late.t - np.arange(1001) * 0.02) == pytest.approx(0.002, rel=0.1)
    assert np.all(np.diff(late.t) > 0.0)


@pytest.mark.parametrize(
    ("codec", "container", "stamps", "keeps"),
    [
        ("ffv1", "mkv", [0, 33, 67, 190, 201], 0.0),
        ("mjpeg", "mkv", [0, 40, 79, 120, 401], 6.0),
        ("mpeg4", "mp4", [0, 2000, 4001, 9000, 9777], 10.0),
        ("mjpeg", "avi", [0, 1, 2, 3, 4], 6.0),
    ],
)
def test_time_stamps_are_kept_exactly(
    tmp_path: Path, codec: str, container: str, stamps: list[int], keeps: float
) -> None:
    filming = Filming(size=(96, 64), codec=codec, container=container)
    rng = np.random.default_rng(0)
    smooth = cv2.GaussianBlur(rng.uniform(0, 255, (5, 64, 96)).astype(np.float32).transpose(1, 2, 0), (0, 0), 4.0)
    frames = [np.clip(128 + 6.0 * (smooth[..., i] - 128), 20, 230).astype(np.uint8) for i in range(5)]
    path = tmp_path / f"video.{container}"
    encode(path, frames, stamps, filming, False)
    with av.open(str(path)) as opened:
        decoded = [(frame.time, frame.to_ndarray(format="gray")) for frame in opened.decode(video=0)]
    np.testing.assert_allclose([time for time, _ in decoded], np.array(stamps) * float(tick(filming)), atol=1e-9)
    for (_, got), want in zip(decoded, frames, strict=True):
        assert np.abs(got.astype(float) - want).mean() <= keeps


def test_coloured_strip_as_bright_as_the_table_has_its_contrast_in_the_colour(tmp_path: Path) -> None:
    scene = Scene.of({"strip": {"colour": [0.2, 0.35, 0.75]}, "filming": {"table": 0.36, "background": 0.36}})
    motion = history_of(scene)
    sensor = Sensor(Renderer(scene, motion.curve[0]), 1.0, np.random.default_rng(1))
    frame = sensor.delivered(sensor.exposed(motion, 0.0), 0.0)
    assert frame.shape == (*scene.filming.size[::-1], 3)
    encode(tmp_path / "film.mkv", [frame], [0], scene.filming, True)
    shown = []
    for channel in range(3):
        with video.read(tmp_path / "film.mkv", None, channel) as frames:
            shown.append(next(frames).image.astype(float))
            assert frames.report.coloured
    rows, columns = np.rint(View.of(scene.filming).in_plane(motion.curve[0][60:90])).astype(int).T[::-1]
    luma, blue, red = (picture[rows - 2, columns].mean() - picture[rows - 30, columns].mean() for picture in shown)
    assert abs(luma) < 12.0
    assert blue > 60.0
    assert red < -20.0


def test_stripes_lie_across_the_strip() -> None:
    plain, striped = (
        Renderer(Scene.of({"length": 0.4, "strip": {"texture": 0.0, **stripes}}), np.array([[0.0, 0.0], [0.4, 0.0]]))
        for stripes in ({}, {"stripe": 0.1, "stripe_shade": 0.5})
    )
    shade = striped._surface_grey / plain._surface_grey
    n = len(shade) // 4
    for k, expected in enumerate((1.0, 0.5, 1.0, 0.5)):
        assert shade[k * n + 2 : (k + 1) * n - 2] == pytest.approx(expected)
