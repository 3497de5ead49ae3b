"""The whole calibration of a recording, camera, folding plane and robot: its mapping, quality and uncertainty."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import CalibrationError
from stripfold.film import intrinsics, recording, video
from stripfold.film.boards import Corners, detect
from stripfold.film.camera import Camera, read_camera
from stripfold.film.intrinsics import Intrinsics, require
from stripfold.film.mapping import Mapping, fit_homography, fit_similarity, rms, scale, transform
from stripfold.film.marker import Marker
from stripfold.film.pictures import read_calibration_picture
from stripfold.film.recording import Entries
from stripfold.film.robot_grid import MIN_STOPS, Stops, find_stops, fit_robot
from stripfold.film.template import Template

MAX_PLANE_RMS = 0.35
"""Residual of the folding plane's homography, pixels."""
MAX_SCALE_ERROR = 0.03
"""Relative difference between the robot's metre and that of the board."""
MAX_SIDE_ERROR, SIDE_BLUR = 0.05, 0.5
"""Relative error of the marker's measured side; pixels added to it, because blur shrinks a black square."""
MAX_ROTATION = np.deg2rad(45.0)
"""Angle of the robot's z from upwards in the picture."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """A mapping from pixels to the robot with the data that it was fitted to.

    ``intrinsics`` is None if the camera was read from a file and is taken as exact.  ``board`` are the corners of the
    board in the folding plane, ``quality`` numbers and texts to be stored and reported (see :func:`assemble`).
    """

    mapping: Mapping
    intrinsics: Intrinsics | None
    board: Corners
    stops: Stops
    quality: dict[str, Any]

    def resample(self, random: np.random.Generator) -> Mapping:
        """A mapping drawn from the uncertainty of the calibration.

        The camera is drawn from its covariance.  The plane and the robot are then fitted again, with noise of the size
        of their residuals; the size itself is drawn too, because few residuals determine it poorly.
        """
        camera = self.mapping.camera if self.intrinsics is None else self.intrinsics.draw(random)
        noise = _noise(self.quality["plane_rms"], len(self.board.pixels), 8, random)
        plane = fit_homography(camera.undistort(self.board.pixels + noise), self.board.object_points[:, :2])
        centres = self.stops.centres(camera, plane)
        noise = _noise(self.quality["robot_rms"], len(centres), 4, random)
        return Mapping(camera, fit_similarity(centres, self.stops.places + noise) @ plane)


def _noise(residual_rms: float, n: int, unknowns: int, random: np.random.Generator) -> Array:
    """Noise, shape (n, 2), that agrees with the RMS of the residuals after a fit of some unknowns."""
    # The sum of squared residuals is sd^2 times a chi-square variable with 2 n - unknowns degrees of freedom.
    sd = residual_rms * np.sqrt(n / random.chisquare(2 * n - unknowns))
    return np.asarray(random.normal(0.0, 1.0, (n, 2)) * sd)


def calibrate_folder(folder: Path, entries: Entries) -> Calibration:
    """The calibration of a recording, given the content of its ``recording.yaml``.

    Raises InvalidInputError: a file is missing or cannot be read; the message names it; CalibrationError: not good
    enough to measure with; the message says which part, and what to do.
    """
    described = entries.camera
    source: Intrinsics | Camera
    if described.intrinsics is not None:
        source = camera = read_camera(folder / described.intrinsics)
    else:
        assert described.images is not None
        assert described.board is not None
        source = intrinsics.calibrate(*intrinsics.find_views(folder / described.images, described.board))
        camera = source.camera
    path = folder / entries.plane.image
    board = detect(read_calibration_picture(path, camera.size), entries.plane.board)
    if board is None:
        raise CalibrationError(
            path.name,
            "the board was not found",
            "a picture of the board in the folding plane",
            "compare its columns and rows with the description; it must be in focus, a chessboard entirely visible",
        )
    stops = find_stops(folder, entries.robot.grid, holder(folder, entries), camera.size)
    side = None if entries.gripper.marker is None else entries.gripper.marker.size
    return assemble(source, board, stops, side, path.name)


def holder(folder: Path, entries: Entries) -> Marker | Template:
    """What is followed of the gripper, as it is found in pictures.

    Raises InvalidInputError: no such marker, or a template that does not stand out in the film's first frame.
    """
    described = entries.gripper.holder
    if isinstance(described, recording.Marker):
        return Marker(described.dictionary, described.id)
    timestamps = None if entries.timestamps is None else folder / entries.timestamps
    with video.read(folder / entries.video, timestamps) as film:
        return Template(next(film).image, described.box)


def assemble(
    source: Intrinsics | Camera, board: Corners, stops: Stops, side: float | None, name: str = "plane"
) -> Calibration:
    """The calibration from the detected corners, with its ``quality``.

    The RMS values of ``camera`` and ``plane`` are in pixels, other lengths in m; the rest are ratios.

    ``source``: the camera's calibration, or a camera that is taken as exact.  ``board``: corners of the board in the
    folding plane.  ``stops``: the robot's stops.  ``side``: side of the gripper's marker, m; None where it has none.
    ``name``: file name of the plane's picture, for errors.  Raises CalibrationError: not good enough to measure with.
    """
    camera, known = (source, None) if isinstance(source, Camera) else (source.camera, source)
    require(
        len(stops.places) >= MIN_STOPS,
        "robot grid",
        f"{len(stops.places)} stops",
        f"{MIN_STOPS} stops or more, better 8 to 12",
    )
    points = board.object_points[:, :2]
    plane = fit_homography(camera.undistort(board.pixels), points)
    plane_rms = rms(camera.distort(transform(np.linalg.inv(plane), points)) - board.pixels)
    require(
        plane_rms <= MAX_PLANE_RMS,
        name,
        f"corners {plane_rms:.2f} px off a plane",
        f"{MAX_PLANE_RMS:g} px or less",
        "is the board flat, and is this the camera, with the same zoom and focus?",
    )
    centres = stops.centres(camera, plane)
    robot, left_out_rms = fit_robot(centres, stops)
    mapping = Mapping(camera, robot @ plane)
    resolution = mapping.resolution(board.pixels.mean(axis=0))
    quality: dict[str, Any] = {
        "camera_from": "file" if known is None else "pictures",
        "camera_uncertainty": "taken as zero" if known is None else "from the views",
        "resolution": resolution,
        "robot_rms": rms(transform(robot, centres) - stops.places),
        "robot_scale": scale(robot),
        "stops": len(stops.places),
    }
    if side is not None:
        corners = mapping.to_robot(stops.corners.reshape(-1, 2)).reshape(-1, 4, 2)
        quality["marker_side"] = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean()) / side
    if known is not None:
        quality |= {
            "camera_rms": known.rms,
            "camera_worst_view_rms": float(known.view_rms.max()),
            "camera_views": len(known.view_rms),
            "camera_coverage": known.coverage,
            "camera_split_half": known.split_half * resolution,
            "camera_inflation": known.inflation,
        }
    quality |= {"plane_rms": plane_rms, "robot_left_out_rms": left_out_rms}
    _check(mapping, board, quality, side)
    return Calibration(mapping, known, board, stops, quality)


def _check(mapping: Mapping, board: Corners, quality: dict[str, Any], side: float | None) -> None:
    """Raise :class:`CalibrationError` unless scale, marker size and orientation are plausible."""
    magnified = quality["robot_scale"]
    require(
        abs(magnified - 1.0) <= MAX_SCALE_ERROR,
        "robot grid",
        f"one metre of the board is {magnified:.3g} m of the robot",
        f"within {MAX_SCALE_ERROR:.0%} of 1 m",
        "are x and z in m, is the board's square as described, was the board held in the folding plane?",
    )
    if side is not None:
        allowed = MAX_SIDE_ERROR + SIDE_BLUR * quality["resolution"] / side
        require(
            abs(quality["marker_side"] - 1.0) <= allowed,
            "robot grid",
            f"markers with sides {quality['marker_side']:.3g} times as long as described",
            f"within {allowed:.0%}",
            "measure the marker's black square; is it in the folding plane?",
        )
    middle = board.pixels.mean(axis=0)
    x, z = np.diff(mapping.to_robot(np.array([middle, middle - [0.0, 1.0]])), axis=0)[0]
    angle = abs(np.arctan2(x, z))
    require(
        angle <= MAX_ROTATION,
        "robot grid",
        f"the robot's z is rotated by {np.rad2deg(angle):.0f} degrees from upwards in the pictures",
        f"{np.rad2deg(MAX_ROTATION):.0f} degrees or less",
        "are the columns x and z swapped, or a sign wrong, or the camera turned on its side?",
    )
