"""A recording's whole calibration, camera, folding plane and robot: its quality, and draws from its uncertainty."""

from __future__ import annotations

from collections.abc import Mapping as Table
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from stripfold.arrays import Array
from stripfold.errors import CalibrationError
from stripfold.vision import calibration, intrinsics_file, pictures
from stripfold.vision.boards import Board, Corners, detect
from stripfold.vision.calibration import STANDS_OUT, Intrinsics
from stripfold.vision.camera import Camera
from stripfold.vision.mapping import Mapping, Similarity, homography, rms, through
from stripfold.vision.robot_grid import FEWEST, Stop, stops_in

LARGEST_PLANE_RMS = 0.35
"""Pixels: residual of the homography of the plane's picture."""
LARGEST_STOP = 0.002
"""Metres: how far a stop may be from where the others put it."""
LEAST_SPREAD = 0.1
"""Of the stops across their longest direction, as a share of that along it."""
LARGEST_SCALE = 0.03
"""By how much a metre of the robot may differ from one of the plane's board."""
LARGEST_SIDE = 0.05
"""By how much the marker's sides may differ from what they are said to be, and:"""
SIDE_PIXELS = 0.5
"""how many pixels more, because blur makes a black square look smaller."""
STEEPEST = np.deg2rad(45.0)
"""How far the robot's z may be from upwards in the pictures."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """A mapping from pixels to the robot, with what it was made of.

    Attributes
    ----------
    mapping
        The best estimate.
    intrinsics
        The camera's calibration; None where the camera came from a file: it is then taken as exact.
    board
        Corners of the board in the folding plane.
    stops
        The robot's stops.
    quality
        Numbers and texts to be stored and shown; see :func:`quality_of`.
    """

    mapping: Mapping
    intrinsics: Intrinsics | None
    board: Corners
    stops: tuple[Stop, ...]
    quality: dict[str, Any]

    def covers(self, pixels: Array) -> NDArray[np.bool_]:
        """Which pixels, shape (n, 2), lie among the board's corners and the stops: others are extrapolated."""
        known = np.concatenate([self.board.pixels, *(stop.corners for stop in self.stops)])
        return np.asarray(Delaunay(known).find_simplex(np.reshape(pixels, (-1, 2))) >= 0)

    def resample(self, random: np.random.Generator) -> Mapping:
        """A mapping from the calibration's uncertainty.

        A camera is drawn from its covariance; with it the plane's picture and the stops are fitted anew, with noise of
        the size of their residuals.  Few residuals tell their size badly: that is drawn too.
        """
        camera = self.mapping.camera if self.intrinsics is None else self.intrinsics.draw(random)
        n = len(self.board.pixels)
        noise = _noise(self.quality["plane_rms"], n, 8, random)
        plane = homography(camera.undistort(self.board.pixels + noise), self.board.object_points[:, :2])
        centres = _centres(camera, plane, self.stops)
        noise = _noise(self.quality["robot_rms"], len(centres), 4, random)
        return Mapping(camera, plane, Similarity.fit(centres, _places(self.stops) + noise))


def _noise(size: float, n: int, unknowns: int, random: np.random.Generator) -> Array:
    """Shape (n, 2), as residuals with the RMS ``size`` (of their length) after a fit of some unknowns tell."""
    # The sum of the residuals' squares is sd^2 times a chi-square of the degrees of freedom.
    sd = size * np.sqrt(n / random.chisquare(2 * n - unknowns))
    return np.asarray(random.normal(0.0, 1.0, (n, 2)) * sd)


def calibrate_folder(folder: Path, recording: Table[str, Any]) -> Calibration:
    """The calibration of a recording.

    Parameters
    ----------
    folder
        The recording's folder.
    recording
        What its recording.yaml holds, valid by the schema.

    Raises
    ------
    InvalidInputError
        A file is missing or cannot be read; the message names it.
    CalibrationError
        Not good enough to measure with; the message says which part, and what to do.
    """
    described = recording["camera"]
    intrinsics: Intrinsics | None = None
    if "intrinsics" in described:
        camera = intrinsics_file.read(folder / described["intrinsics"])
    else:
        views, size = calibration.views_in(folder / described["images"], Board.of(described["board"]))
        intrinsics = calibration.calibrate(views, size)
        camera = intrinsics.camera
    image = folder / recording["plane"]["image"]
    board = detect(pictures.of_size(image, camera.size), Board.of(recording["plane"]["board"]))
    if board is None:
        raise CalibrationError(
            image.name,
            "no board as described",
            "a picture of the board in the folding plane",
            "compare its columns and rows with the description; it must be sharp, a chessboard whole",
        )
    marker = recording["gripper"]["marker"]
    stops = stops_in(folder / recording["robot"]["grid"], marker["dictionary"], marker["id"], camera.size)
    return assemble(camera if intrinsics is None else intrinsics, board, stops, marker["size"], image.name)


def assemble(
    source: Intrinsics | Camera, board: Corners, stops: Sequence[Stop], side: float, name: str = "plane"
) -> Calibration:
    """The calibration from what was found in the pictures.

    Parameters
    ----------
    source
        The camera's calibration, or a camera that is taken as exact.
    board
        Corners of the board in the folding plane.
    stops
        The robot's stops.
    side
        Side of the gripper's marker, m.
    name
        Of the plane's picture, for messages.

    Raises
    ------
    CalibrationError
        Not good enough to measure with.
    """
    intrinsics = source if isinstance(source, Intrinsics) else None
    camera = source.camera if isinstance(source, Intrinsics) else source
    if len(stops) < FEWEST:
        raise CalibrationError("robot grid", f"{len(stops)} stops", f"{FEWEST} stops or more, better 8 to 12")
    plane, plane_rms = fit_plane(camera, board)
    if not plane_rms <= LARGEST_PLANE_RMS:
        raise CalibrationError(
            name,
            f"corners {plane_rms:.2f} px off a plane",
            f"{LARGEST_PLANE_RMS:g} px or less",
            "is the board flat, and is this the camera, with the same zoom and focus?",
        )
    robot, left_out = fit_robot(_centres(camera, plane, stops), stops)
    mapping = Mapping(camera, plane, robot)
    quality = quality_of(mapping, intrinsics, board, stops, side) | {"plane_rms": plane_rms}
    quality["robot_left_out_rms"] = rms(left_out)
    _check(mapping, board, quality, side)
    return Calibration(mapping, intrinsics, board, tuple(stops), quality)


def fit_plane(camera: Camera, board: Corners) -> tuple[Array, float]:
    """The homography from undistorted pixels to the board's plane, m, and the RMS of what is left, pixels."""
    points = board.object_points[:, :2]
    plane = homography(camera.undistort(board.pixels), points)
    return plane, rms(camera.distort(through(np.linalg.inv(plane), points)) - board.pixels)


def fit_robot(centres: Array, stops: Sequence[Stop]) -> tuple[Similarity, Array]:
    """The similarity from the plane to the robot, and how far each stop is from where the others put it.

    Parameters
    ----------
    centres
        Shape (n, 2): the markers' centres in the plane, m.
    stops
        The stops, n of them.

    Returns
    -------
    Similarity, array of shape (n, 2), m

    Raises
    ------
    CalibrationError
        Stops on a line, one that stands out, or stops that no similarity fits.
    """
    places, n = _places(stops), len(stops)
    for found in (places, centres):
        along, across = np.linalg.svd(found - found.mean(axis=0), compute_uv=False)
        if not across > LEAST_SPREAD * along:
            raise CalibrationError("robot grid", "stops on a line", "stops spread over x and z")
    whole = Similarity.fit(centres, places)
    left_out = np.empty((n, 2))
    for i in range(n):
        rest = np.arange(n) != i
        left_out[i] = Similarity.fit(centres[rest], places[rest]).apply(centres[[i]])[0] - places[i]
    # In metres of the plane: a table in millimetres is told by its scale, not by its residuals.
    left_out /= whole.scale
    off = np.linalg.norm(left_out, axis=1)
    worst = int(np.argmax(off))
    if not off[worst] <= LARGEST_STOP:
        alone = off[worst] > STANDS_OUT * np.median(off)
        raise CalibrationError(
            stops[worst].name if alone else "robot grid",
            f"a stop {off[worst] * 1e3:.1f} mm from where the others put it",
            f"{LARGEST_STOP * 1e3:g} mm or less",
            "is each picture in its row, does the marker move in the folding plane, was the camera still?",
        )
    return whole, left_out


def quality_of(
    mapping: Mapping, intrinsics: Intrinsics | None, board: Corners, stops: Sequence[Stop], side: float
) -> dict[str, Any]:
    """What a calibration is worth: RMS in pixels (``camera``, ``plane``), all other lengths in m, shares as such."""
    centres = _centres(mapping.camera, mapping.plane, stops)
    middle = board.pixels.mean(axis=0)
    resolution = float(mapping.resolution(middle)[0])
    sides = [np.linalg.norm(found - np.roll(found, 1, axis=0), axis=1).mean() for found in _squares(mapping, stops)]
    found: dict[str, Any] = {
        "camera_from": "file" if intrinsics is None else "pictures",
        "camera_uncertainty": "taken as zero" if intrinsics is None else "from the views",
        "resolution": resolution,
        "robot_rms": rms(mapping.robot.apply(centres) - _places(stops)),
        "robot_scale": mapping.robot.scale,
        "marker_side": float(np.mean(sides)) / side,
        "stops": len(stops),
    }
    if intrinsics is not None:
        found |= {
            "camera_rms": intrinsics.rms,
            "camera_worst_view_rms": float(intrinsics.view_rms.max()),
            "camera_views": len(intrinsics.names),
            "camera_coverage": intrinsics.coverage,
            "camera_split_half": intrinsics.split_half * resolution,
            "camera_inflation": intrinsics.inflation,
        }
    return found


def _check(mapping: Mapping, board: Corners, quality: Table[str, Any], side: float) -> None:
    off = quality["robot_scale"] - 1.0
    if not abs(off) <= LARGEST_SCALE:
        raise CalibrationError(
            "robot grid",
            f"a metre of the plane's board that is {1.0 + off:.3g} m of the robot's",
            f"within {LARGEST_SCALE:.0%} of 1 m",
            "are x and z in m, is the board's square as described, was the board held in the folding plane?",
        )
    allowed = LARGEST_SIDE + SIDE_PIXELS * quality["resolution"] / side
    if not abs(quality["marker_side"] - 1.0) <= allowed:
        raise CalibrationError(
            "robot grid",
            f"markers with sides {quality['marker_side']:.3g} times as long as described",
            f"within {allowed:.0%}",
            "measure the marker's black square; is it in the folding plane?",
        )
    middle = board.pixels.mean(axis=0)
    x, z = np.diff(mapping.to_robot(np.array([middle, middle - [0.0, 1.0]])), axis=0)[0]
    angle = abs(np.arctan2(x, z))
    if not angle <= STEEPEST:
        raise CalibrationError(
            "robot grid",
            f"the robot's z turned by {np.rad2deg(angle):.0f} degrees from upwards in the pictures",
            f"{np.rad2deg(STEEPEST):.0f} degrees or less",
            "are the columns x and z swapped, or a sign wrong, or the camera turned on its side?",
        )


def _squares(mapping: Mapping, stops: Sequence[Stop]) -> Array:
    """Shape (n, 4, 2): the markers' corners, by the robot, m."""
    return mapping.to_robot(np.concatenate([stop.corners for stop in stops])).reshape(-1, 4, 2)


def _centres(camera: Camera, plane: Array, stops: Sequence[Stop]) -> Array:
    """Shape (n, 2): the markers' centres in the plane, m."""
    corners = camera.undistort(np.concatenate([stop.corners for stop in stops]))
    return np.asarray(through(plane, corners).reshape(-1, 4, 2).mean(axis=1))


def _places(stops: Sequence[Stop]) -> Array:
    return np.array([stop.place for stop in stops])
