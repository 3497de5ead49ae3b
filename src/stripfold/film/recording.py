"""The folder of a recording: ``recording.yaml`` read and validated, its files found."""

from __future__ import annotations

import os
from dataclasses import dataclass
from math import hypot, log10
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator
from scipy.special import ndtri

from stripfold.base.errors import MISSING, InvalidInputError, MeasurementError
from stripfold.base.material import Material
from stripfold.base.validation import HEIGHT_STAR, EtaB, Flag, Input, Number, Text, Whole, quantity, read_yaml, within
from stripfold.film.boards import Board, Dictionary
from stripfold.film.clock import SLOW_MOTION, RobotLog, middle_speed, read_log
from stripfold.film.snap import MIN_ADVANCE

if TYPE_CHECKING:
    from stripfold.film.tracking import Tracks

NAME = "recording.yaml"
MAX_HEIGHT_ERROR = 0.05
"""Largest difference between the described height and that of the robot's log, as a share."""
MAX_LOG_SPEED_RATIO = 30.0
"""Described speed over that of the log, or the reverse, from which on a unit must be wrong; less is a fast approach."""
POWER_OF_TEN = 0.03
"""How near to a power of ten, in log10, the ratio of two values is when a unit or a decimal point is wrong."""
MAX_FLAT_END_ERROR = 0.08
"""Largest difference between measured and described ``flat_end``, as a share of the strip's length: tight bends and
wide strips are seen too short."""
MAX_SPEED_RATIO = 5.0
"""Described speed over that of the film, or the reverse, from which on a unit must be wrong."""


def half_width(share: float) -> float:
    """Half the width of the confidence interval with this probability, in standard deviations: errors are normal."""
    return float(ndtri(0.5 + 0.5 * share))


SD_95 = 1.0 / half_width(0.95)
"""Standard deviation over half the width of a 95 % interval."""
DEVIATIONS = 3.0
"""Standard deviations between a given number and what the film says of it from which one of them is wrong."""

FilePath = Text
Offset = Annotated[Number, quantity("part of an offset", "m", ge=-1.0, le=1.0)]
HAND = 0.002
"""Largest error of what is measured by hand that is not excluded unless less is stated, m: 95 % are smaller."""


class StripEntry(Input):
    """The strip, as described."""

    length: Annotated[Number, quantity("length", "m", gt=0.0, le=10.0)]
    eta_b: EtaB
    eta_b_interval: Annotated[tuple[EtaB, EtaB] | None, Field(description="95 % interval of eta_b, m^-4 s^2")] = None
    friction_moment: Annotated[
        Number | None, quantity("M_0 of the fabric's bending hysteresis, per width", "N", ge=0.0, le=0.1)
    ] = None
    rho_a: Annotated[Number | None, quantity("areal density, with friction_moment", "kg m^-2", gt=0.0, le=10.0)] = None
    width: Annotated[Number | None, quantity("width", "m", gt=0.0, le=2.0)] = None
    material: Text | None = None

    @model_validator(mode="after")
    def _check_material(self) -> Self:
        interval = self.eta_b_interval
        if interval is not None and not interval[0] <= self.eta_b <= interval[1]:
            raise InvalidInputError("eta_b_interval", list(interval), f"two numbers around eta_b = {self.eta_b:g}")
        if self.friction_moment is not None and self.rho_a is None:
            raise InvalidInputError("rho_a", MISSING, "an areal density together with friction_moment", "in kg m^-2")
        return self


class MarkerEntry(Input):
    """The gripper's marker."""

    dictionary: Dictionary
    id: Annotated[Whole, quantity("which marker of the dictionary", ge=0)]
    size: Annotated[Number, quantity("side of its black square", "m", gt=0.0, le=1.0)]
    offset: Annotated[
        tuple[Offset, Offset], Field(description="from its centre to the strip's end, x and z of the robot, m")
    ]
    offset_uncertainty: Annotated[Number, quantity("of x and of z of the offset, 95 %", "m", ge=0.0, le=0.1)] = HAND


class TemplateEntry(Input):
    """A part of the gripper in the first frame, where it has no marker."""

    box: Annotated[
        tuple[Whole, Whole, Whole, Whole], Field(description="x and y of its first pixel, width, height, pixels")
    ]
    offset: Annotated[
        tuple[Offset, Offset], Field(description="from the box's centre to the strip's end, x and z of the robot, m")
    ]
    offset_uncertainty: Annotated[Number, quantity("of x and of z of the offset, 95 %", "m", ge=0.0, le=0.1)] = HAND


class GripperEntry(Input):
    """The gripper; x and z are the robot's."""

    height: Annotated[Number, quantity("z of the gripped end", "m", gt=0.0)]
    height_uncertainty: Annotated[Number, quantity("of height, 95 %", "m", ge=0.0, le=0.1)] = HAND
    speed: Annotated[Number, quantity("speed along x", "m s^-1", gt=0.0, le=1.0)]
    flat_end: Annotated[
        Number, quantity("x of the gripped end while the strip lay flat: lambda = 0", "m", ge=-1e3, le=1e3)
    ]
    flat_end_uncertainty: Annotated[Number, quantity("of flat_end, 95 %", "m", ge=0.0, le=0.1)] = HAND
    direction: Annotated[Literal[1, -1], Field(description="1 where x grows as the gripper advances")] = 1
    marker: MarkerEntry | None = None
    template: TemplateEntry | None = None

    @property
    def holder(self) -> MarkerEntry | TemplateEntry:
        """What is followed of the gripper."""
        found = self.marker or self.template
        assert found is not None
        return found

    @model_validator(mode="after")
    def _check_one_holder(self) -> Self:
        if (self.marker is None) == (self.template is None):
            given = MISSING if self.marker is None else "given"
            raise InvalidInputError("marker", given, "a marker, or a template where there is none, and not both")
        return self


class CameraEntry(Input):
    """The camera: pictures of a board, or its intrinsics."""

    images: Annotated[FilePath | None, Field(description="folder of pictures of a board")] = None
    board: Board | None = None
    intrinsics: Annotated[
        FilePath | None,
        Field(
            description="a file as OpenCV writes it: camera_matrix, distortion_coefficients, image_width, image_height"
        ),
    ] = None
    rolling_shutter: Annotated[
        Number, quantity("from the exposure of the first row to that of the last", "s", ge=0.0, le=0.1)
    ] = 0.0

    @model_validator(mode="after")
    def _check_one_source(self) -> Self:
        if (self.images or self.board) and self.intrinsics:
            raise InvalidInputError(
                "intrinsics", self.intrinsics, "nothing together with images and board", "give only one"
            )
        for key in ("images", "board"):
            if not self.intrinsics and getattr(self, key) is None:
                raise InvalidInputError(
                    key, MISSING, "the images and the board of a calibration", "or give intrinsics instead"
                )
        return self


class PlaneEntry(Input):
    """The folding plane."""

    image: Annotated[FilePath, Field(description="picture of a board held in the folding plane")]
    board: Board


class RobotEntry(Input):
    """The robot."""

    grid: Annotated[
        FilePath,
        Field(description="CSV image,x,z: where the marker's centre was, m, in each picture of 8 to 12 stops"),
    ]


class Entries(Input):
    """A recording of a strip whose gripper advances at constant height.

    Lengths are in m, times in s; x and z are those of the robot.
    """

    title: Annotated[Text, Field(description="what was filmed, in one line")]
    synthetic: Annotated[Flag, Field(description="whether the recording was computed, not filmed")] = False
    strip: StripEntry
    gripper: GripperEntry
    video: Annotated[FilePath, Field(description="the film, or a folder of frames whose names sort in time")]
    timestamps: Annotated[FilePath | None, Field(description="CSV frame,t: needed with a folder of frames")] = None
    robot_log: Annotated[
        FilePath | None, Field(description="CSV t,x,z: the gripped end by the robot, by its own clock")
    ] = None
    robot_log_columns: Annotated[
        tuple[Text, Text, Text] | None, Field(description="names or numbers of its columns t, x and z, if others")
    ] = None
    camera: CameraEntry
    plane: PlaneEntry
    robot: RobotEntry

    @model_validator(mode="after")
    def _check_height(self) -> Self:
        height, length = self.gripper.height, self.strip.length
        if not height < length:
            allowed = f"less than strip.length = {length:g} m"
            raise InvalidInputError("gripper.height", height, allowed, "the unit is m: is a decimal point missing?")
        unit = Material(self.strip.eta_b).gravity_length
        if not HEIGHT_STAR[0] <= height / unit <= HEIGHT_STAR[1]:
            allowed = "one with which gripper.height is {:g} to {:g} L*".format(*HEIGHT_STAR)
            advice = f"it is {height / unit:.3g} L* with L* = {unit:.3g} m: the units are m^-4 s^2 and m"
            raise InvalidInputError("strip.eta_b", self.strip.eta_b, allowed, advice)
        return self


class ManualOnset(Input):
    """The onset of the snap, set by hand."""

    file_name: ClassVar[str] = "manual_onset.yaml"
    event_time: Annotated[Number, quantity("onset of the snap by the video's clock", "s", ge=-1e6, le=1e6)]
    sd: Annotated[Number, quantity("its standard deviation", "s", gt=0.0, le=1e3)]
    reason: Annotated[Text, Field(description="why it was set by hand")]


@dataclass(frozen=True, eq=False)
class Recording:
    """A recording: its folder, and the entries of recording.yaml."""

    folder: Path
    entries: Entries

    @property
    def video(self) -> Path:
        """The film, or a folder of frames."""
        return self.folder / self.entries.video

    @property
    def timestamps(self) -> Path | None:
        """The times of the frames in a folder."""
        return None if self.entries.timestamps is None else self.folder / self.entries.timestamps

    @property
    def robot_log(self) -> Path | None:
        """The robot's log; None where there is none."""
        return None if self.entries.robot_log is None else self.folder / self.entries.robot_log

    def manual_onset(self) -> ManualOnset | None:
        """The onset set by hand, None where there is none; InvalidInputError: its file cannot be used."""
        name = ManualOnset.file_name
        if not os.path.lexists(self.folder / name):
            return None
        path = inside(self.folder, name, name)
        with within(name):
            return ManualOnset(**read_yaml(path, "", "event_time: 3.5"))


def other_unit(given: float, other: float) -> str:
    """Advice where two values of one quantity differ by a power of ten; empty where they do not."""
    if not given * other > 0.0:
        return ""
    power = log10(given / other)
    if abs(round(power)) < 1 or abs(power - round(power)) > POWER_OF_TEN:
        return ""
    return f"they differ by a factor of {10.0 ** abs(round(power)):g}: is it in m and s, is a decimal point missing?"


def inside(folder: Path, name: str | Path, key: str) -> Path:
    """The path of a file of a recording; InvalidInputError: it lies outside the folder, or is a link to there."""
    if "\0" in str(name) or folder.resolve() not in (folder / name).resolve().parents:
        allowed = "a path inside the recording's folder, and no link out of it"
        raise InvalidInputError(key, str(name), allowed, "copy the file there")
    return folder / name


def _check_log(log: RobotLog, entries: Entries, path: Path) -> None:
    """Raise InvalidInputError for a log without the described height, or with a speed in other units."""
    gripper = entries.gripper
    z = float(np.median(log.z))
    if not np.any(np.abs(log.z - gripper.height) <= MAX_HEIGHT_ERROR * gripper.height):
        allowed = f"z within {MAX_HEIGHT_ERROR:.0%} of gripper.height = {gripper.height:g} m"
        advice = other_unit(z, gripper.height) or "is it z of the gripped end, 0 on the table?"
        raise InvalidInputError("robot_log", f"z of {z:.4g}", allowed, f"{advice} ({path.name})")
    speed = middle_speed(log.time, log.x)
    if not 1.0 / MAX_LOG_SPEED_RATIO < speed / gripper.speed < MAX_LOG_SPEED_RATIO:
        allowed = f"about gripper.speed = {gripper.speed:g} m/s"
        advice = other_unit(speed, gripper.speed) or "is it the log of this run?"
        raise InvalidInputError("robot_log", f"a speed along x of {speed:.2g}", allowed, f"{advice} ({path.name})")


def read(folder: str | os.PathLike[str]) -> Recording:
    """Read a recording and check its entries, the files that they name, its tables and its manual onset.

    Raises InvalidInputError: one of them is missing, unusable, outside the folder, also by a link, or in other units.
    """
    folder = Path(folder)
    path = folder / NAME
    if not path.is_file():
        raise InvalidInputError("recording", str(folder), f"a folder with a {NAME}", "docs/measuring.md shows one")
    entries = Entries.of(read_yaml(inside(folder, NAME, "recording"), NAME, "title: a strip"))
    named = {
        "video": entries.video,
        "timestamps": entries.timestamps,
        "robot_log": entries.robot_log,
        "camera.images": entries.camera.images,
        "camera.intrinsics": entries.camera.intrinsics,
        "plane.image": entries.plane.image,
        "robot.grid": entries.robot.grid,
    }
    for key, name in named.items():
        if name is None:
            continue
        path = inside(folder, name, key)
        if not path.exists():
            raise InvalidInputError(key, name, "an existing file or folder of the recording", f"looked in {folder}")
        for link in filter(Path.is_symlink, path.iterdir() if path.is_dir() else ()):
            inside(folder, link.relative_to(folder), key)
    found = Recording(folder, entries)
    if found.video.is_dir() and found.timestamps is None:
        allowed = "a file beside a folder of frames"
        raise InvalidInputError("timestamps", MISSING, allowed, "frames have no time stamps of their own")
    # To read the film takes long: what else is wrong is said before.
    found.manual_onset()
    if found.robot_log is not None:
        _check_log(read_log(found.robot_log, entries.robot_log_columns), entries, found.robot_log)
    return found


def compare(entries: Entries, tracks: Tracks) -> None:
    """Raise MeasurementError where height, direction, speed or the flat strip are not as described."""
    gripper = entries.gripper
    z = float(np.median(tracks.gripped_end[tracks.gripper.tracked, 1]))
    most = DEVIATIONS * SD_95 * hypot(gripper.height_uncertainty, gripper.holder.offset_uncertainty)
    _agree(
        abs(z - gripper.height) <= most,
        f"gripper.height = {gripper.height:g} m, the video shows {z:.4f} m",
        f"at most {1e3 * most:.1f} mm between them",
        other_unit(gripper.height, z)
        or "is z of the robot 0 on the table, and the offset right? or give gripper.height_uncertainty",
    )
    first, last = tracks.gripped_end[[0, -1], 0]
    _agree(
        gripper.direction * (last - first) > -MIN_ADVANCE,
        f"gripper.direction = {gripper.direction}, in the video x of the gripper goes from {first:.3f} to {last:.3f} m",
        "a gripper that advances in its direction",
        "change the direction; or has x a wrong sign in the table of the robot grid?",
    )
    speed = middle_speed(tracks.grip_time, tracks.gripped_end[:, 0])
    _agree(
        abs(last - first) < MIN_ADVANCE or 1.0 / MAX_SPEED_RATIO < speed / gripper.speed < MAX_SPEED_RATIO,
        f"gripper.speed = {gripper.speed:g} m/s, the video shows {speed:.2g} m/s",
        "about the described speed",
        other_unit(gripper.speed, speed) or f"are the times of the frames in s? {SLOW_MOTION}",
    )
    found = flat_end(entries, tracks)
    _agree(
        abs(found - gripper.flat_end) <= MAX_FLAT_END_ERROR * entries.strip.length,
        f"gripper.flat_end = {gripper.flat_end:g} m, by the lying part in the video it was at {found:.3f} m",
        f"a difference of at most {MAX_FLAT_END_ERROR:.0%} of the strip's length",
        other_unit(gripper.flat_end, found) or "is it x of the robot at the near end of the flat strip, with its sign?",
    )


def flat_end(entries: Entries, tracks: Tracks) -> float:
    """x of the gripped end while the strip lay flat, m: too far by 1 to 3 % of the length, as bends are seen short."""
    far = float(np.nanmedian(tracks.points[:, -1, 0]))
    return far - entries.gripper.direction * float(tracks.stations[-1])


def _agree(holds: bool, found: str, needed: str, advice: str) -> None:
    if not holds:
        raise MeasurementError(NAME, found, needed, advice)
