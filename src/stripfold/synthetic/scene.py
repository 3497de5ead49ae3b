"""The scene of a synthetic recording, in SI units: strip, gripper, filming and motion."""

from __future__ import annotations

import os
from typing import Annotated, Any, Literal, Self

from pydantic import model_validator

from stripfold.base.errors import InvalidInputError
from stripfold.base.material import GRAVITY
from stripfold.base.validation import (
    Air,
    Flag,
    Input,
    MovingModel,
    Number,
    Stiffness,
    Text,
    Whole,
    quantity,
    read_yaml,
    value_meant,
    within,
)

CONTAINERS = {"ffv1": ("mkv",), "mjpeg": ("mkv", "avi"), "mpeg4": ("mp4",)}
MAX_PIXELS = 4096 * 2160

Grey = Annotated[Number, quantity("grey, as a share of white", ge=0.0, le=1.0)]
Share = Annotated[Number, quantity("share", ge=0.0, le=0.5)]
Place = Annotated[Number, quantity("coordinate", "m", ge=-10.0, le=10.0)]
Offset = Annotated[Number, quantity("coordinate", "m", ge=-1.0, le=1.0)]
Pixels = Annotated[Whole, quantity("pixels", ge=64, le=4096)]
Angle = Annotated[Number, quantity("angle", "degrees", ge=-30.0, le=30.0)]
Lens = Annotated[Number, quantity("coefficient of the lens", ge=-0.5, le=0.5)]
Noise = Annotated[Number, quantity("standard deviation", "grey values", ge=0.0, le=50.0)]
Duration = Annotated[Number, quantity("duration", "s", ge=0.0, le=0.1)]


class Strip(Input):
    """The look of the strip."""

    width: Annotated[Number, quantity("width", "m", ge=1e-3, le=2.0)] = 0.03
    thickness: Annotated[Number, quantity("thickness", "m", ge=1e-5, le=0.02)] = 1e-3
    grey: Grey = 0.85
    edge: Grey = 0.95
    """Grey of the cut edge, which faces the camera."""
    colour: tuple[Grey, Grey, Grey] | None = None
    """Red, green and blue of surface and edge, instead of a grey: the film is then in colour."""
    stripe: Annotated[Number, quantity("length of the stripes across the strip; 0: none", "m", ge=0.0, le=1.0)] = 0.0
    stripe_shade: Grey = 0.6
    """Of every second stripe, relative to the others."""
    texture: Annotated[Number, quantity("standard deviation of the weave's grey", ge=0.0, le=0.3)] = 0.03
    hairs: Annotated[Number, quantity("loose fibres at the edge", "m^-1", ge=0.0, le=1e4)] = 0.0
    material: Text = "synthetic fabric"


class Gripper(Input):
    """The gripper and its marker."""

    direction: Literal[1, -1] = 1
    """-1 for a robot whose x decreases as the gripper advances."""
    finger: Annotated[Number, quantity("length of the strip's end hidden by the finger", "m", ge=0.0, le=0.1)] = 3e-3
    marker: Annotated[Whole, quantity("which marker of 4x4_50", ge=0, le=49)] = 7
    marker_size: Annotated[Number, quantity("side of the marker", "m", ge=1e-3, le=1.0)] = 0.024
    offset: tuple[Offset, Offset] = (0.0, -0.032)
    """From the marker's centre to the strip's end, x and z."""


class Filming(Input):
    """The camera, its film, and the robot log.

    The centre of the picture shows ``target``, x and z in the folding plane, from ``distance``.  ``field`` is the width
    of the folding plane that an undistorted picture would show.  A frame's time stamp is the middle of the exposure of
    its first row.
    """

    size: tuple[Pixels, Pixels] = (480, 360)
    frame_rate: Annotated[Number, quantity("frames per second", "s^-1", ge=1.0, le=1000.0)] = 30.0
    target: tuple[Place, Place] = (0.08, 0.085)
    distance: Annotated[Number, quantity("distance of the camera", "m", ge=0.05, le=20.0)] = 0.9
    field: Annotated[Number, quantity("width of the field of view", "m", ge=0.01, le=20.0)] = 0.32
    tilt: Annotated[Number, quantity("downward tilt of the camera", "degrees", ge=0.0, le=30.0)] = 4.0
    yaw: Angle = 0.0
    roll: Angle = 0.0
    behind: Flag = False
    """Whether the camera is on the other side: robot x increases to the left."""
    distortion: tuple[Lens, Lens, Lens, Lens] = (-0.1, 0.03, 0.0, 0.0)
    """k1, k2, p1, p2."""
    exposure: Duration = 0.004
    rolling_shutter: Duration = 0.0
    """Exposure of the last row after that of the first."""
    defocus: Annotated[Number, quantity("standard deviation of the blur", "pixels", ge=0.0, le=10.0)] = 0.5
    shot_noise: Noise = 0.5
    """At white, of the part proportional to the square root of the light."""
    read_noise: Noise = 1.0
    """Of the part independent of the light."""
    light: Annotated[Number, quantity("grey of white paper in the middle, share of 255", ge=0.02, le=1.0)] = 0.8
    gradient: Annotated[Number, quantity("share by which light falls from left to right", ge=0.0, le=0.8)] = 0.1
    flicker: Annotated[Number, quantity("amplitude of a flicker at 100 Hz, share", ge=0.0, le=0.5)] = 0.0
    shadow: Annotated[Number, quantity("share of light that a moving shadow takes", ge=0.0, le=0.9)] = 0.0
    occluder: Annotated[Number, quantity("width of an object moving in front; 0: none", "m", ge=0.0, le=0.2)] = 0.0
    background: Grey = 0.25
    table: Grey = 0.35
    grain: Annotated[Number, quantity("standard deviation of the table's grey, share", ge=0.0, le=0.5)] = 0.05
    codec: Literal["ffv1", "mjpeg", "mpeg4"] = "ffv1"
    container: Literal["mkv", "avi", "mp4"] = "mkv"
    quality: Annotated[Whole, quantity("quantiser of mjpeg and mpeg4: 2 is the best", ge=2, le=31)] = 3
    jitter: Annotated[Number, quantity("standard deviation of the frame interval, share", ge=0.0, le=0.3)] = 0.0
    dropped: Share = 0.0
    """Of missing frames."""
    dropped_at_event: Annotated[Whole, quantity("frames missing from where the snap begins", ge=0, le=100)] = 0
    doubled: Share = 0.0
    """Of frames that repeat the one before."""
    timestamps: Flag = False
    """Whether the times are in timestamps.csv; those of the container then have a constant rate."""
    log_rate: Annotated[Number, quantity("rows of the robot's log per second", "s^-1", ge=5.0, le=1000.0)] = 100.0
    log_offset: Annotated[Number, quantity("robot's clock at time 0 of the video", "s", ge=-1e4, le=1e4)] = 0.0
    plate: Place | None = None
    """x of the left edge of the plate's squares, which stands on the table in the folding plane.  With it the film
    begins with the flat strip."""
    plate_depth: Place = 0.0
    """Of the plate behind the folding plane."""
    plate_scale: Annotated[Number, quantity("size of the printed plate over that asked for", ge=0.9, le=1.1)] = 1.0
    board: Literal["chessboard", "charuco"] = "chessboard"
    views: Annotated[Whole, quantity("pictures of the board for the intrinsics", ge=4, le=40)] = 10

    @model_validator(mode="after")
    def _check_film(self) -> Self:
        if self.container not in CONTAINERS[self.codec]:
            words = " or ".join(CONTAINERS[self.codec])
            raise InvalidInputError("container", self.container, f"{words} with codec {self.codec}")
        width, height = self.size
        if width * height > MAX_PIXELS or width % 2 or height % 2:
            raise InvalidInputError("size", [width, height], f"two even numbers, together {MAX_PIXELS} pixels")
        uneven = self.jitter or self.dropped or self.dropped_at_event
        if self.container == "avi" and uneven and not self.timestamps:
            raise InvalidInputError("container", "avi", "mkv or mp4", "avi keeps no time stamps: set timestamps, too")
        return self


class ShapesMotion(Input):
    """A motion without mechanics: arcs and straight pieces moved by a law of one variable (the generator "shapes")."""

    law: Literal["parabolic", "cubic", "power", "two_modes"] = "parabolic"
    before: Annotated[Number, quantity("start of the film before lambda_c", "m", ge=1e-3, le=1.0)] = 0.02
    after: Annotated[Number, quantity("length of the film after the touch", "s", ge=0.2, le=20.0)] = 1.0
    inertia: Annotated[Number, quantity("T_i of the law", "s", ge=0.0, le=1.0)] = 0.07
    drag: Annotated[Number, quantity("T_d of the law", "s", ge=1e-3, le=5.0)] = 0.05
    cubic: Annotated[Number, quantity("factor of the cubic law", ge=0.01, le=1.0)] = 0.3
    exponent: Annotated[Number, quantity("exponent of the power law", ge=0.3, le=0.8)] = 0.5


class DynamicsMotion(Input):
    """A motion from the project's own dynamics, with friction in bending (the generator "dynamics")."""

    friction_moment_star: Annotated[
        Number, quantity("M_0 of the fabric's bending hysteresis", "rho_a g L*^2", ge=0.0, le=2.0)
    ] = 0.01
    air: Air = 2.0
    stiffness: Stiffness = 3e-3
    before: Annotated[Number, quantity("start before the loss of stability", "m", ge=1e-3, le=0.1)] = 0.01
    after: Annotated[Number, quantity("duration after the first touch", "s", ge=0.0, le=5.0)] = 1.0
    eta_m: Annotated[Number, quantity("weight-to-membrane-stiffness ratio", "m^-2 s^2", ge=1e-8, le=1.0)] = 1e-3
    model: MovingModel = "solid"
    refinement: Annotated[Number, quantity("factor on the element lengths", ge=0.25, le=4.0)] = 2.0
    """Half of it is equivalent for a rod, whose elements have half the nodes."""


MOTIONS: dict[str, type[ShapesMotion] | type[DynamicsMotion]] = {"shapes": ShapesMotion, "dynamics": DynamicsMotion}


class Scene(Input):
    """A synthetic recording; its title always says that it is synthetic.

    ``length``, ``eta_b``, ``height`` and ``speed`` have the names that they have in a scene of a simulation.
    """

    length: Annotated[Number, quantity("length of the strip", "m", ge=0.05, le=10.0)] = 0.45
    eta_b: Annotated[Number, quantity("weight-to-bending-stiffness ratio", "m^-4 s^2", ge=0.1, le=1e8)] = 3780.0
    height: Annotated[Number, quantity("height of the gripper", "m", ge=1e-3, le=10.0)] = 0.1
    speed: Annotated[Number, quantity("speed of the gripper", "m s^-1", ge=1e-4, le=1.0)] = 0.01
    strip: Strip = Strip()
    gripper: Gripper = Gripper()
    filming: Filming = Filming()
    generator: Literal["shapes", "dynamics"] = "shapes"
    motion: ShapesMotion | DynamicsMotion = ShapesMotion()
    seed: Annotated[Whole, quantity("seed of the random numbers", ge=0, le=2**32 - 1)] = 0
    title: Text = "synthetic recording"

    @property
    def gravity_length(self) -> float:
        """L*, m."""
        return float((self.eta_b * GRAVITY) ** (-1.0 / 3.0))

    @property
    def flat_end(self) -> float:
        """x of the gripped end of the flat strip, m: the origin is mid-strip."""
        return -self.length / 2.0

    @model_validator(mode="before")
    @classmethod
    def _motion_of_generator(cls, given: Any) -> Any:
        kind = MOTIONS.get(str(given.get("generator", "shapes")))
        if kind is None or isinstance(motion := given.get("motion", {}), kind):
            return given
        with within("motion"):
            return {**given, "motion": kind.of(motion)}

    @model_validator(mode="after")
    def _check_gripper(self) -> Self:
        low, high = 2.0 * self.gravity_length, 0.8 * self.length
        if not low <= self.height <= high:
            advice = value_meant(self.height, "m", low, high)
            raise InvalidInputError("height", self.height, f"from 2 L* = {low:.3g} m to {high:.3g} m", advice)
        if "synthetic" not in self.title.lower():
            object.__setattr__(self, "title", f"{self.title} (synthetic)")
        return self

    def as_config(self) -> dict[str, Any]:
        """All keys and values, defaults included."""
        return self.model_dump(mode="json")


def read(path: str | os.PathLike[str]) -> Scene:
    """A scene from a YAML file.

    Raises InvalidInputError: not readable, or a key or value that cannot be used.
    """
    return Scene(**read_yaml(path, "scene", "length: 0.45"))
