"""Synthetic recordings: what is drawn is where it should be, arrives when it should, and is labelled."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
import yaml
from scipy.integrate import odeint

from stripfold import cli, store
from stripfold.arrays import Array
from stripfold.errors import InvalidInputError
from stripfold.synthetic import render, shapes
from stripfold.synthetic.calibration import COLUMNS, ROWS, Calibration
from stripfold.synthetic.history import STATIONS, History
from stripfold.synthetic.laws import solve
from stripfold.synthetic.recording import history_of, write_recording
from stripfold.synthetic.render import Renderer
from stripfold.synthetic.scene import DynamicsMotion, Filming, Scene, ShapesMotion, read
from stripfold.synthetic.sensor import Sensor
from stripfold.synthetic.video import encode, tick, timeline
from stripfold.synthetic.view import Rays, View
from stripfold.vision.recording import checked
from studies import recordings_design as design

ROOT = Path(__file__).parents[1]

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


def test_the_target_is_in_the_middle_and_the_field_as_wide_as_said() -> None:
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


def test_rays_and_pixels_are_each_other_s_inverse() -> None:
    wide = {**STILL, "distortion": [-0.3, 0.08, 2e-3, -2e-3], "distance": 0.25}
    view = View.of(Scene(filming=wide).filming)
    directions = Rays(view.camera, 2).directions.astype(float)
    assert directions.shape == (480, 640, 2)
    some = directions[::53, ::53].reshape(-1, 2)
    back = view.camera.project(np.column_stack([some, np.ones(len(some))]), np.zeros(3), np.zeros(3))
    columns, rows = np.meshgrid(np.arange(0, 640, 53), np.arange(0, 480, 53))
    np.testing.assert_allclose(back, np.column_stack([columns.ravel(), rows.ravel()]) / 2 - 0.25, atol=2e-3)


@pytest.mark.parametrize("behind", [False, True])
def test_what_is_nearer_hides_what_is_behind(behind: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Against rays through the strip's cross-section."""
    monkeypatch.setattr(render, "_LIGHT", np.zeros(2))
    filming = {**STILL, "tilt": 12.0, "behind": behind, "size": [640, 480]}
    scene = Scene(filming=filming, strip={"texture": 0.0, "width": 0.2, "thickness": 1e-4})
    turns = np.linspace(0.0, 2.5 * np.pi, 400)
    radius = 0.03 + 0.0015 * turns
    curve = np.column_stack([0.08 + radius * np.cos(turns), 0.085 + radius * np.sin(turns)])
    renderer = Renderer(scene, curve)
    count = len(renderer._surface_grey)
    renderer._surface_grey = np.linspace(0.1, 1.0, count)
    renderer._edge_grey = renderer._surface_grey * 0.7
    picture = renderer.picture(curve, FAR).astype(float) / 255.0
    fine = renderer._refine @ curve
    eye = renderer.view.place[[0, 2]]
    start, side = fine[:-1] - eye, np.diff(fine, axis=0)
    checked = wrong = hiding = badly = 0
    rows, columns = np.nonzero(picture > 0.05)
    rays = np.linalg.inv(renderer.view.camera.matrix) @ np.vstack(
        [renderer.view.camera.undistort(np.column_stack([columns, rows]).astype(float)).T, np.ones(len(rows))]
    )
    world = renderer.view.matrix.T @ rays
    front = abs(renderer.view.place[1])
    for i in range(0, len(rows), 7):
        # In the cross-section a ray goes straight away from the eye: share 1 is the folding plane.
        slope = world[[0, 2], i] / abs(world[1, i]) * front
        det = slope[0] * -side[:, 1] + slope[1] * side[:, 0]
        share = (start[:, 0] * -side[:, 1] + start[:, 1] * side[:, 0]) / det
        along = (slope[0] * start[:, 1] - slope[1] * start[:, 0]) / det
        hit = (along >= 0) & (along <= 1) & (share > 1.01) & (share < 1.0 + scene.strip.width / front)
        if not hit.any():
            continue
        first = np.flatnonzero(hit)[np.argmin(share[hit])]
        off = abs(picture[rows[i], columns[i]] - 0.7 * renderer._surface_grey[first]) > 0.03
        checked += 1
        wrong += off
        if np.ptp(np.flatnonzero(hit)) > 30:  # something else would be seen, were it not hidden
            hiding += 1
            badly += off
    # Only where a border runs through the pixel.
    assert checked > 200
    assert wrong < 0.04 * checked
    assert hiding > 40
    assert badly < 0.15 * hiding


@pytest.mark.parametrize("kind", ["chessboard", "charuco"])
def test_boards_are_found_where_they_are(kind: str) -> None:
    filming = {"size": [480, 360], "board": kind, "distortion": [-0.2, 0.05, 1e-3, -1e-3], "defocus": 0.8, "views": 5}
    calibration = Calibration(Renderer(Scene(filming=filming), np.eye(2)), np.random.default_rng(0))
    board, camera = calibration.board, calibration.renderer.view.camera
    poses = [*calibration.poses(), calibration.plane_pose()]
    assert len(poses) == 6
    seen, errors = [], []
    inner = board.square * np.array([[column, row, 0.0] for row in range(1, ROWS) for column in range(1, COLUMNS)])
    for rotation, translation in poses:
        picture = calibration.picture((rotation, translation))
        truth = camera.project(inner, cv2.Rodrigues(rotation)[0].ravel(), translation)
        said = board.as_config()
        if kind == "chessboard":
            found, corners = cv2.findChessboardCorners(picture, (said["columns"], said["rows"]))
            assert found
            which, half = np.arange(40), 4
            corners = corners.reshape(-1, 2)
            if np.linalg.norm(corners[0] - truth[0]) > 10.0:
                corners = corners[::-1]  # found from its other end
        else:
            dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
            size = (said["columns"], said["rows"])
            made = cv2.aruco.CharucoBoard(size, said["square"], said["marker"], dictionary)
            corners, which, _, _ = cv2.aruco.CharucoDetector(made).detectBoard(picture)
            which, half = which.ravel(), 2  # the markers are close
            assert len(which) > 30
        start = np.ascontiguousarray(corners.reshape(-1, 1, 2))
        corners = cv2.cornerSubPix(picture, start, (half, half), (-1, -1), (3, 40, 1e-4)).reshape(-1, 2)
        errors.append(corners - truth[which])
        seen.append(truth)
    assert max(np.sqrt(np.mean(np.sum(error**2, axis=1))) for error in errors) < 0.1
    assert np.abs(np.concatenate(errors).mean(axis=0)).max() < 0.03
    reached = np.concatenate(seen)
    assert np.all(np.ptp(reached, axis=0) > [0.7 * 480, 0.65 * 360])


def test_the_plane_board_and_the_stops_are_in_the_folding_plane() -> None:
    scene = Scene(filming={"size": [480, 360], "behind": True, "tilt": 6.0, "roll": 2.0, "stop_noise": 0.0})
    calibration = Calibration(Renderer(scene, np.eye(2)), np.random.default_rng(1))
    view = calibration.renderer.view
    rotation, translation = calibration.plane_pose()
    places = (calibration.board.outline @ rotation.T + translation - view.translation) @ view.matrix
    np.testing.assert_allclose(places[:, 1], 0.0, atol=1e-12)
    # A margin of 0.6 squares around 9 by 6 of them.
    sides = np.linalg.norm(np.diff(places, axis=0), axis=1)
    np.testing.assert_allclose(sides, calibration.board.square * np.array([10.2, 7.2, 10.2]))
    detector = cv2.aruco.ArucoDetector(render.DICTIONARY)
    stops = calibration.stops()
    assert len(stops) == 9
    for place in stops:
        picture = calibration.renderer.picture(None, place + scene.gripper.offset)
        corners, ids, _ = detector.detectMarkers(np.ascontiguousarray(picture))
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


def seen_moving(speed: float, **filming: float) -> tuple[Array, Scene]:
    given = {**STILL, "exposure": 0.0, "tilt": 0.0, "distortion": [0, 0, 0, 0], **filming}
    scene = Scene(filming=given, strip={**EDGE, "width": 1e-3})
    history = moving(speed)
    sensor = Sensor(Renderer(scene, history.curve[0]), 1.0, np.random.default_rng(0))
    return sensor.exposed(history, 0.2).astype(float), scene


def test_a_history_between_its_moments() -> None:
    history = moving(0.3)
    curve, gripper = history.at(np.array([-1.0, 0.3331, 9.0]))
    np.testing.assert_allclose(gripper[:, 0], [0.05, 0.05 + 0.3 * 0.3331, 0.35], atol=1e-12)
    np.testing.assert_allclose(curve[:, 7, 0], gripper[:, 0], atol=1e-12)
    assert history.displacement(0.2, 0.3) == pytest.approx(0.03)


def test_rolling_shutter_shears() -> None:
    speed, shutter = 0.25, 0.03
    rows = np.arange(30, 190)
    upright = centroids(seen_moving(speed)[0], 1)[rows]
    sheared = centroids(seen_moving(speed, rolling_shutter=shutter)[0], 1)[rows]
    slope = np.polyfit(rows, sheared - upright, 1)[0]
    assert slope == pytest.approx(speed * shutter / 239 * 320 / 0.32, rel=0.05)
    assert (sheared - upright)[0] == pytest.approx(slope * 30, abs=0.15)


def test_motion_blur_is_as_long_as_the_way() -> None:
    speed, exposure = 0.25, 0.03
    row = 100
    still, blurred = (seen_moving(speed, exposure=e)[0][row] for e in (0.0, exposure))
    places = np.arange(320)

    def spread(profile: Array) -> tuple[float, float]:
        middle = np.average(places, weights=profile)
        return middle, np.average((places - middle) ** 2, weights=profile)

    (at, narrow), (now, wide) = spread(still), spread(blurred)
    assert np.sqrt(12.0 * (wide - narrow)) == pytest.approx(speed * exposure * 320 / 0.32, rel=0.03)
    assert now == pytest.approx(at, abs=0.02)  # the time stamp is the middle of the exposure
    assert blurred.sum() == pytest.approx(still.sum(), rel=0.02)


def test_noise_and_light() -> None:
    scene = Scene(filming={**BARE, "shot_noise": 4.0, "read_noise": 2.0, "light": 0.8, "gradient": 0.2})
    sensor = Sensor(Renderer(scene, np.eye(2)), 1.0, np.random.default_rng(0))
    for seen in (50.0, 200.0):
        picture = sensor.delivered(np.full((240, 320), seen, dtype=np.float32), None).astype(float)[:200]
        middle = picture[:, 150:170]
        assert middle.mean() == pytest.approx(0.8 * seen, rel=0.01)
        # The rounding to whole grey values adds a twelfth.
        variance = 4.0**2 * 0.8 * seen / 255.0 + 2.0**2 + 1.0 / 12.0
        assert middle.std() == pytest.approx(np.sqrt(variance), rel=0.04)
        assert picture[:, :8].mean() / picture[:, -8:].mean() == pytest.approx(1.1 / 0.9, rel=0.02)


def test_flicker_is_seen_in_the_rows_of_a_rolling_shutter() -> None:
    scene = Scene(filming={**STILL, "flicker": 0.2, "rolling_shutter": 0.02})
    sensor = Sensor(Renderer(scene, np.eye(2)), 1.0, np.random.default_rng(0))
    picture = sensor.delivered(np.full((240, 320), 150.0, dtype=np.float32), 0.003).astype(float)
    rows = picture[:, :200].mean(axis=1) / 150.0
    expected = 1.0 + 0.2 * np.sin(2 * np.pi * 100.0 * (0.003 + 0.02 * np.arange(240) / 239))
    np.testing.assert_allclose(rows, expected, atol=0.01)


def test_frames_that_are_dropped_doubled_and_late() -> None:
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
    encode(path, frames, stamps, filming)
    with av.open(str(path)) as opened:
        decoded = [(frame.time, frame.to_ndarray(format="gray")) for frame in opened.decode(video=0)]
    np.testing.assert_allclose([time for time, _ in decoded], np.array(stamps) * float(tick(filming)), atol=1e-9)
    for (_, got), want in zip(decoded, frames, strict=True):
        assert np.abs(got.astype(float) - want).mean() <= keeps


@pytest.mark.parametrize("law", ["parabolic", "cubic", "power", "two_modes"])
def test_the_family_keeps_the_length_and_ends_at_the_gripper(law: str) -> None:
    for seed in range(2):
        scene = Scene(seed=seed, motion={"law": law}, gripper={"height": 0.09 + 0.025 * seed})
        history = shapes.history(scene)
        np.testing.assert_allclose(history.curve[:, 0], history.gripper, atol=1e-9)
        np.testing.assert_allclose(
            history.curve[:, -1], np.broadcast_to([0.225, 0.0], history.gripper.shape), atol=1e-9
        )
        assert history.curve[..., 1].min() > -1e-9
        steps = np.linalg.norm(np.diff(history.curve, axis=1), axis=2)
        # A chord is shorter than its arc, by (arc * curvature)^2 / 24 of it.
        arc = scene.strip.length / (STATIONS - 1)
        assert steps.max() < arc * (1 + 1e-9)
        assert np.abs(steps.sum(axis=1) / scene.strip.length - 1.0).max() < 1e-3
        at = np.searchsorted(history.t, history.touch)
        folded = history.curve[at, history.curve[at, :, 1] > 0.0]
        sag = folded[folded[:, 0] > folded[:, 0].min() + 0.04]
        assert scene.strip.thickness * 0.99 < sag[:, 1].min() < scene.strip.thickness + 5e-4
        assert history.t[1] - history.t[0] <= 1.0 / 500.0 + 1e-12


def test_length_is_kept_at_a_finer_look() -> None:
    """Richardson: the part of the chords' error that falls with the square of their length is all there is."""
    family = shapes.Family(0.45, 0.1, -0.225, 0.058, 0.087, 1.5)
    one = np.ones(1)
    curve = family.curves(0.32 * one, 0.008 * one, 0.0 * one, 0.0 * one)[0]
    chords = [np.linalg.norm(np.diff(curve[::step], axis=0), axis=1).sum() for step in (1, 3)]
    assert (9 * chords[0] - chords[1]) / 8 == pytest.approx(0.45, rel=5e-5)


@pytest.mark.parametrize(
    ("law", "inertia"), [("parabolic", 0.07), ("parabolic", 0.0), ("cubic", 0.05), ("power", 0.05)]
)
def test_motion_laws_against_another_integrator(law: str, inertia: float) -> None:
    motion = ShapesMotion(law=law, before=0.01, after=0.6, inertia=inertia, drag=0.1, cubic=0.4, exponent=0.42)
    found = solve(motion, 0.3, 0.03, 0.01)
    assert found.onset is not None
    assert found.touch is not None
    # lambda by hand: at rest for 0.3 s, a cosine ramp of 0.2 s, then the speed.
    assert float(np.interp(found.onset, found.t, found.advance)) == pytest.approx(0.3, abs=1e-7)
    assert found.onset == pytest.approx(0.3 + 0.1 + 1.0, abs=1e-9)

    def advance(t: float) -> float:
        share = min(max((t - 0.3) / 0.2, 0.0), 1.0)
        ramp = 0.1 * (share - np.sin(np.pi * share) / np.pi)
        return 0.29 + 0.01 * (ramp + max(t - 0.5, 0.0))

    def rates(y: Array, t: float) -> list[float]:
        mu = (0.3 - advance(t)) / 0.03
        push = {
            "parabolic": y[0] ** 2 - 0.36 * mu,
            "cubic": y[0] ** 2 + 0.4 * y[0] ** 3 - 0.36 * mu,
            "power": abs(y[0]) ** (1 / 0.42) - 0.6 ** (1 / 0.42) * mu,
        }[law]
        if inertia == 0.0:
            return [push / 0.1, 0.0]
        return [y[1], (push - 0.1 * y[1]) / inertia**2]

    if law == "parabolic":
        assert found.q[0] == pytest.approx(-0.6 * np.sqrt(1 / 3))
    if law == "power":
        assert found.q[0] == pytest.approx(-0.6 * (1 / 3) ** 0.42)
    assert rates(np.array([found.q[0], 0.0]), 0.0)[1 if inertia else 0] == pytest.approx(0.0, abs=1e-8)
    before = found.t < found.touch
    again = odeint(rates, [found.q[0], 0.0], found.t[before], rtol=1e-9, atol=1e-11, hmax=0.01)
    np.testing.assert_allclose(found.q[before], again[:, 0], atol=2e-5)
    assert np.all(found.q[~before] == 1.0)
    assert found.q[before][-1] > 0.9
    assert found.advance[-1] - found.advance[-2] == pytest.approx(0.0, abs=1e-9)  # stopped


def test_a_gripper_that_stops_short_of_the_snap() -> None:
    scene = Scene(motion={"short": 0.004, "before": 0.012, "after": 1.0})
    history = shapes.history(scene)
    assert history.lambda_c is None
    assert history.events() == {"onset": None, "fall": None, "fastest": None, "touch": None}
    assert np.ptp(history.gripper[:, 0]) == pytest.approx(0.008 + 0.001, abs=1e-4)  # and half a ramp
    with pytest.raises(InvalidInputError, match="short"):
        shapes.history(Scene(motion={"short": 1e-4, "before": 0.012}, gripper={"speed": 0.02}))


SMALL = {
    "filming": {"size": [320, 240], "frame_rate": 20.0, "dropped": 0.06, "doubled": 0.1, "log_offset": 12.5},
    "gripper": {"speed": 0.02},
    "motion": {"before": 0.008, "after": 0.5},
    "seed": 3,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scene = Scene(**SMALL)
    path = tmp_path_factory.mktemp("synthetic") / "small"
    write_recording(history_of(scene), scene, path)
    return path


def test_a_folder_can_be_read_and_says_that_it_is_synthetic(folder: Path) -> None:
    config = yaml.safe_load((folder / "recording.yaml").read_text(encoding="utf-8"))
    checked(config)
    assert config["synthetic"] is True
    assert "synthetic" in config["title"]
    named = [config["video"], config["robot_log"], config["plane"]["image"], config["robot"]["grid"]]
    assert all((folder / name).is_file() for name in named)
    assert len(list((folder / config["camera"]["images"]).glob("*.png"))) == 10
    grid = (folder / config["robot"]["grid"]).read_text(encoding="utf-8").splitlines()
    assert grid[0] == "image,x,z"
    assert all((folder / "calibration" / row.split(",")[0]).is_file() for row in grid[1:])
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    assert truth["synthetic"] is True
    assert sorted(path.name for path in folder.parent.iterdir()) == ["small"]  # no temporary folders


def test_frames_of_a_folder(folder: Path) -> None:
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    with av.open(str(folder / "video.mkv")) as opened:
        decoded = [(frame.time, frame.to_ndarray(format="gray")) for frame in opened.decode(video=0)]
    frames = truth["frames"]
    np.testing.assert_allclose([time for time, _ in decoded], frames["t"], atol=1e-9)
    assert frames["dropped"]
    together = sorted([*frames["t"], *frames["dropped"]])
    np.testing.assert_allclose(together, np.arange(len(together)) / 20.0, atol=1e-9)
    same = [np.array_equal(decoded[i][1], decoded[i - 1][1]) for i in range(1, len(decoded))]
    known = [shown < time for shown, time in zip(frames["shown"][1:], frames["t"][1:], strict=True)]
    # A doubled frame may follow one that did not arrive: then it shows what nobody saw.
    for i, (got, want) in enumerate(zip(same, known, strict=True)):
        lost = any(frames["t"][i] < gone < frames["t"][i + 1] for gone in frames["dropped"])
        assert got == (want and not lost)
    assert any(same)
    # The word stands in the lower right corner.
    bare, label = decoded[0][1][-16:-2, 100:190], decoded[0][1][-16:-2, -60:]
    assert label.max() > bare.max() + 40


def test_truth_of_a_folder(folder: Path) -> None:
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    data = store.read(folder / "truth.nc")
    advance, t = data["lambda"].values, data["time"].values
    events = truth["events"]
    assert events["onset"]["lambda"] == pytest.approx(truth["lambda_c"], abs=1e-6)
    for moment in events.values():
        assert moment["lambda"] == pytest.approx(np.interp(moment["t"], t, advance), abs=1e-9)
    assert events["onset"]["t"] < events["fall"]["t"] < events["fastest"]["t"] <= events["touch"]["t"]
    assert data["curve"].shape == (len(t), 100, 2)
    speed = np.linalg.norm(np.gradient(data["curve"].values.astype(float), t, axis=0), axis=2).max(axis=1) - 0.02
    top, start = (np.interp(events[name]["t"], t, speed) for name in ("fastest", "fall"))
    assert top == pytest.approx(speed[t <= events["touch"]["t"]].max(), rel=0.01)
    assert start == pytest.approx(0.25 * top, rel=0.1)
    log = np.loadtxt(folder / "robot.csv", delimiter=",", skiprows=1)
    assert np.abs(log[:, 1] - np.interp(log[:, 0] - 12.5, t, data["gripper"].values[:, 0])).max() < 1e-4
    assert log[:, 1].std() > 1e-3


def test_the_same_seed_gives_the_same_recording(folder: Path, tmp_path: Path) -> None:
    scene = Scene(**SMALL)
    history = history_of(scene)
    write_recording(history, scene, tmp_path / "again", folder / "calibration")
    for name in ("video.mkv", "robot.csv", "truth.json", "recording.yaml"):
        assert (tmp_path / "again" / name).read_bytes() == (folder / name).read_bytes(), name
    first = Sensor(Renderer(scene, history.curve[0]), 1.0, np.random.default_rng(1)).exposed(history, 0.5)
    other = Scene(**{**SMALL, "seed": 4})
    assert not np.array_equal(
        first, Sensor(Renderer(other, history.curve[0]), 1.0, np.random.default_rng(1)).exposed(history, 0.5)
    )


def test_an_existing_folder_is_left_alone(folder: Path) -> None:
    scene = Scene(**SMALL)
    with pytest.raises(InvalidInputError, match="not there yet"):
        write_recording(moving(0.1), scene, folder)


def test_a_failure_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise RuntimeError("no room on the disc")

    scene = Scene(**SMALL)
    monkeypatch.setattr("stripfold.synthetic.recording.encode", fails)
    monkeypatch.setattr("stripfold.synthetic.recording.write_calibration", lambda *_: None)
    with pytest.raises(RuntimeError):
        write_recording(moving(0.02, 0.3), scene, tmp_path / "new")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("given", "key", "says"),
    [
        ({"film": {}}, "film", "did you mean filming"),
        ({"filming": {"frame_rte": 30}}, "filming.frame_rte", "did you mean frame_rate"),
        ({"filming": {"frame_rate": "fast"}}, "filming.frame_rate", "a number"),
        ({"filming": {"frame_rate": float("nan")}}, "filming.frame_rate", "a number"),
        ({"filming": {"size": [320]}}, "filming.size", "a list of 2"),
        ({"filming": {"size": [321, 240]}}, "filming.size", "even"),
        ({"filming": {"size": [1e9, 240]}}, "filming.size[0]", "whole"),
        ({"filming": {"codec": "h264"}}, "filming.codec", "ffv1, mjpeg, mpeg4"),
        ({"filming": {"codec": "mpeg4", "container": "mkv"}}, "filming.container", "mp4"),
        ({"filming": {"codec": "mjpeg", "container": "avi", "jitter": 0.1}}, "filming.container", "timestamps"),
        ({"filming": [1]}, "filming", "keys and values"),
        ({"strip": {"length": -1}}, "strip.length", "from 0.05"),
        ({"gripper": {"height": 0.5}}, "gripper.height", "L"),
        ({"gripper": {"marker": 3.5}}, "gripper.marker", "whole"),
        ({"generator": "magic"}, "generator", "shapes, dynamics"),
        ({"motion": 3}, "motion", "keys and values"),
        ({"seed": -1}, "seed", "from 0"),
    ],
)
def test_bad_scenes(given: dict[str, object], key: str, says: str) -> None:
    with pytest.raises(InvalidInputError, match=says) as caught:
        Scene(**given)
    assert caught.value.key == key


@pytest.mark.parametrize(
    "motion", [{"lw": "cubic"}, {"law": "quartic"}, {"inertia": -1.0}, {"law": "cubic", "cubic": 1.0, "before": 0.06}]
)
def test_bad_motions(motion: dict[str, object]) -> None:
    with pytest.raises(InvalidInputError, match="motion"):
        shapes.history(Scene(motion=motion))


def test_scene_files(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    scene = Scene(**SMALL)
    path.write_text(yaml.safe_dump(scene.as_config()), encoding="utf-8")
    assert read(path) == scene
    assert Scene(title="a test").title == "a test (synthetic)"
    for text in ("- 1", "strip: [", ""):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(InvalidInputError, match="scene"):
            read(path)


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    given = {"filming": {"size": [160, 120], "frame_rate": 5.0, "views": 4}, "gripper": {"speed": 0.03}}
    Path("own.yaml").write_text(yaml.safe_dump({**given, "motion": {"before": 0.008, "after": 0.3}}), encoding="utf-8")
    assert cli.main(["record", "own.yaml"]) == 0
    assert "synthetic" in capsys.readouterr().out
    assert (tmp_path / "own/recording.yaml").is_file()
    assert cli.main(["record", "own.yaml"]) == 2
    assert "not there yet" in capsys.readouterr().err
    assert cli.main(["record", "own.yaml", "--output", "no/such/folder"]) == 2
    assert cli.main(["record", "none.yaml"]) == 2


def test_design() -> None:
    cases = [design.case(number, 0) for number in range(2 * design.BLOCK)]
    assert design.case(7, 0).scene == cases[7].scene
    assert design.case(7, seed=1).scene != cases[7].scene
    assert len({case.scene.seed for case in cases}) == len(cases)
    for name, values in design.FACTORS.items():
        counts = Counter(case.factors[name] for case in cases)
        for value, count in Counter(values).items():
            assert abs(counts[value] - 2 * design.BLOCK * count / len(values)) <= 2 * len(values), name
    other = design.case(3, 0, dynamics=1.0).scene
    assert other.motion == DynamicsMotion(friction=0.0, before=0.01, after=0.5)
    assert other.filming == cases[3].scene.filming
