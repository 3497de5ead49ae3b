"""What a synthetic recording is made of: the strip, the gripper, how it is filmed; in SI units."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from stripfold import schemas
from stripfold.errors import InvalidInputError
from stripfold.material import GRAVITY
from stripfold.synthetic.checking import checked, known_keys

GENERATORS = ("shapes", "dynamics")
CODECS = ("ffv1", "mjpeg", "mpeg4")
CONTAINERS = {"ffv1": ("mkv",), "mjpeg": ("mkv", "avi"), "mpeg4": ("mp4",)}
BOARDS = ("chessboard", "charuco")
MOST_PIXELS = 4096 * 2160

# Lowest and highest value, both allowed.
_RANGES: dict[str, tuple[float, float]] = {
    **{"length": (0.05, 10.0), "eta_b": (0.1, 1e8), "width": (1e-3, 2.0), "thickness": (1e-5, 0.02)},
    **{"grey": (0.0, 1.0), "edge": (0.0, 1.0), "texture": (0.0, 0.3), "hairs": (0.0, 1e4)},
    **{"height": (1e-3, 10.0), "speed": (1e-4, 1.0), "finger": (0.0, 0.1), "marker": (0, 49)},
    **{"marker_size": (1e-3, 1.0), "offset": (-1.0, 1.0), "size": (64, 4096), "frame_rate": (1.0, 1000.0)},
    **{"target": (-10.0, 10.0), "distance": (0.05, 20.0), "field": (0.01, 20.0), "tilt": (0.0, 30.0)},
    **{"yaw": (-30.0, 30.0), "roll": (-30.0, 30.0), "distortion": (-0.5, 0.5), "exposure": (0.0, 0.1)},
    **{"rolling_shutter": (0.0, 0.1), "defocus": (0.0, 10.0), "shot_noise": (0.0, 50.0), "read_noise": (0.0, 50.0)},
    **{"light": (0.02, 1.0), "gradient": (0.0, 0.8), "flicker": (0.0, 0.5), "shadow": (0.0, 0.9)},
    **{"passing": (0.0, 0.2), "background": (0.0, 1.0), "table": (0.0, 1.0), "quality": (2, 31), "jitter": (0.0, 0.3)},
    **{"dropped": (0.0, 0.5), "dropped_at_event": (0, 100), "doubled": (0.0, 0.5), "log_rate": (5.0, 1000.0)},
    **{"log_offset": (-1e4, 1e4), "log_noise": (0.0, 1e-2), "stop_noise": (0.0, 1e-2), "views": (4, 40)},
    **{"seed": (0, 2**32 - 1)},
}
_CHOICES = {"codec": CODECS, "board": BOARDS, "container": ("mkv", "avi", "mp4")}


@dataclass(frozen=True, slots=True)
class Strip:
    """The strip; lengths in m, greys as shares of white."""

    length: float = 0.45
    eta_b: float = 3780.0
    width: float = 0.03
    thickness: float = 1e-3
    grey: float = 0.85
    edge: float = 0.95
    """Grey of the cut edge, which faces the camera."""
    texture: float = 0.03
    """Standard deviation of the weave's grey along the strip."""
    hairs: float = 0.0
    """Loose fibres at the edge per metre."""
    material: str = "synthetic fabric"

    @property
    def gravity_length(self) -> float:
        """L*, m."""
        return float((self.eta_b * GRAVITY) ** (-1.0 / 3.0))

    @property
    def flat_end(self) -> float:
        """x of the gripped end while the strip lay flat, m: the origin is mid-strip."""
        return -self.length / 2.0


@dataclass(frozen=True, slots=True)
class Gripper:
    """The gripper and its marker; m and m/s."""

    height: float = 0.1
    speed: float = 0.01
    finger: float = 3e-3
    """How much of the strip's end the gripper's finger hides."""
    marker: int = 7
    """Which marker of 4x4_50."""
    marker_size: float = 0.024
    offset: tuple[float, float] = (0.0, -0.032)
    """From the marker's centre to the strip's end, x and z."""


@dataclass(frozen=True, slots=True)
class Filming:
    """How a motion is filmed.

    The picture's centre looks at ``target``, x and z in the folding plane, from ``distance``.  ``field`` is the width
    of the folding plane that an undistorted picture would show.  A frame's time stamp is the middle of the exposure of
    its first row.
    """

    size: tuple[int, int] = (480, 360)
    frame_rate: float = 30.0
    target: tuple[float, float] = (0.08, 0.085)
    distance: float = 0.9
    field: float = 0.32
    tilt: float = 4.0
    """How far the camera looks down, degrees."""
    yaw: float = 0.0
    roll: float = 0.0
    behind: bool = False
    """Whether the camera looks from the other side: robot x grows to the left."""
    distortion: tuple[float, float, float, float] = (-0.1, 0.03, 0.0, 0.0)
    """k1, k2, p1, p2."""
    exposure: float = 0.004
    rolling_shutter: float = 0.0
    """From the exposure of the first row to that of the last, s."""
    defocus: float = 0.5
    """Standard deviation of the blur, pixels."""
    shot_noise: float = 0.5
    """Standard deviation at white of what grows with the square root of the light, grey values."""
    read_noise: float = 1.0
    """Standard deviation that is everywhere, grey values."""
    light: float = 0.8
    """Grey value of white paper in the middle, as a share of 255."""
    gradient: float = 0.1
    """Share by which light falls from the left of the picture to its right."""
    flicker: float = 0.0
    """Amplitude of a flicker at 100 Hz, as a share."""
    shadow: float = 0.0
    """Share of the light that a shadow takes which moves through the picture."""
    passing: float = 0.0
    """Width of a thing that passes in front of the strip, m; 0 for none."""
    background: float = 0.25
    """Grey of what is behind, as a share of white."""
    table: float = 0.35
    """Grey of the table."""
    codec: str = "ffv1"
    container: str = "mkv"
    quality: int = 3
    """Quantiser of mjpeg and mpeg4: 2 is the best, 31 the worst."""
    jitter: float = 0.0
    """Standard deviation of the time between frames, as a share of it."""
    dropped: float = 0.0
    """Share of frames that are missing."""
    dropped_at_event: int = 0
    """Frames missing from where the snap begins."""
    doubled: float = 0.0
    """Share of frames that show the one before again."""
    timestamps: bool = False
    """Whether the times stand in timestamps.csv; the container's are then those of a constant rate."""
    log_rate: float = 100.0
    log_offset: float = 0.0
    """What the robot's clock shows where the video's shows 0, s."""
    log_noise: float = 2e-5
    """Standard deviation of a logged place, m."""
    stop_noise: float = 5e-5
    """Standard deviation of a place in the calibration of the robot, m."""
    board: str = "chessboard"
    views: int = 10
    """Pictures of the board for the intrinsics."""


@dataclass(frozen=True, slots=True)
class Scene:
    """A whole synthetic recording; make it with :meth:`create` or :func:`read`."""

    strip: Strip = Strip()
    gripper: Gripper = Gripper()
    filming: Filming = Filming()
    generator: str = "shapes"
    motion: Mapping[str, Any] = field(default_factory=dict)
    """What the generator is asked for; it checks its own keys."""
    seed: int = 0
    title: str = "synthetic recording"

    @classmethod
    def create(cls, **given: Any) -> Scene:
        """From plain mappings, as they stand in a file.

        Raises
        ------
        InvalidInputError
            An unknown key, or a value that cannot be used.
        """
        known_keys(given, tuple(item.name for item in fields(cls)), "")
        parts: dict[str, Any] = {"strip": Strip, "gripper": Gripper, "filming": Filming}
        values = {key: checked(parts[key], given[key], key, _RANGES, _CHOICES) for key in parts if key in given}
        if "motion" in given:
            if not isinstance(given["motion"], Mapping):
                raise InvalidInputError("motion", given["motion"], "keys and values")
            values["motion"] = {str(key): value for key, value in given["motion"].items()}
        if given.get("generator", "shapes") not in GENERATORS:
            raise InvalidInputError("generator", given["generator"], " or ".join(GENERATORS))
        plain = checked(_Plain, {key: given[key] for key in ("seed", "title") if key in given}, "", _RANGES, _CHOICES)
        title = plain.title if "synthetic" in plain.title.lower() else f"{plain.title} (synthetic)"
        scene = cls(**values, generator=given.get("generator", "shapes"), seed=plain.seed, title=title)
        _check_together(scene)
        return scene

    def as_config(self) -> dict[str, Any]:
        """The resolved keys and values, as they could be given."""
        parts = {key: _plain(asdict(getattr(self, key))) for key in ("strip", "gripper", "filming")}
        rest = {"generator": self.generator, "motion": dict(self.motion), "seed": self.seed, "title": self.title}
        return {**parts, **rest}


@dataclass(frozen=True, slots=True)
class _Plain:
    seed: int = 0
    title: str = "synthetic recording"


def _check_together(scene: Scene) -> None:
    filming = scene.filming
    if filming.container not in CONTAINERS[filming.codec]:
        allowed = " or ".join(CONTAINERS[filming.codec])
        raise InvalidInputError("filming.container", filming.container, f"{allowed} with codec {filming.codec}")
    width, height = filming.size
    if width * height > MOST_PIXELS or width % 2 or height % 2:
        raise InvalidInputError("filming.size", [width, height], f"two even numbers, together {MOST_PIXELS} pixels")
    if not scene.strip.gravity_length * 2.0 <= scene.gripper.height <= 0.8 * scene.strip.length:
        low, high = scene.strip.gravity_length * 2.0, 0.8 * scene.strip.length
        raise InvalidInputError("gripper.height", scene.gripper.height, f"from 2 L* = {low:.3g} m to {high:.3g} m")
    uneven = filming.jitter or filming.dropped or filming.dropped_at_event
    if filming.container == "avi" and uneven and not filming.timestamps:
        raise InvalidInputError(
            "filming.container", "avi", "mkv or mp4", "avi keeps no time stamps: ask for timestamps, too"
        )


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return list(value) if isinstance(value, tuple) else value


def read(path: str | os.PathLike[str]) -> Scene:
    """A scene from a YAML file.

    Raises
    ------
    InvalidInputError
        Not readable, not a mapping, or a key or value that cannot be used.
    """
    return Scene.create(**schemas.read_scene(path, "strip: {length: 0.45}"))
