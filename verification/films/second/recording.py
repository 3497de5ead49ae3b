"""Recordings of the chain: their design, their motion, their truth, and the folder that ``stripfold measure`` reads."""

from __future__ import annotations

import json
import shutil
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import yaml

from verification.films.second.chain import STEP, Chain, Hinges, critical
from verification.films.second.picture import Array, Camera, Light, Look, Studio, exposed

GRAVITY = 9.81
LENGTH = 15.0
"""Length of the strips, L*."""
RATE = 500.0
"""Stored states per second."""
TARGET = (-0.115, 0.083)
"""x and z of the chain's frame in the middle of the picture, m."""
CAMERAS: tuple[dict[str, Any], ...] = (
    {"size": (320, 240), "field": 0.31, "distance": 0.9, "bend": -0.25, "tilt": 4.0, "yaw": 2.0},
    {"size": (400, 300), "field": 0.30, "distance": 0.7, "bend": 0.1, "tilt": 5.5, "yaw": -3.0, "roll": 1.5},
    {"size": (400, 300), "field": 0.32, "distance": 1.2, "bend": -0.6, "tilt": 3.0, "roll": -2.0},
    {"size": (480, 360), "field": 0.33, "distance": 0.8, "bend": -0.15, "tilt": 6.5, "yaw": 4.0},
)
ROBOTS = ((1.0, 0.0), (-1.0, 0.4), (1.0, -0.3), (-1.0, 0.1))
"""Of each camera: the sign of the robot's x in the world, and its origin, m."""
START = 0.02
"""Time of the motion at which the film begins, s; video files count from there, time stamps from the motion's 0."""
PACES = ((0.0015, 15.0), (0.002, 20.0), (0.003, 25.0), (0.004, 30.0), (0.006, 40.0))
FILES = ("video.avi", "video.mkv", "video.mp4", "frames")
CODECS = {"video.avi": "MJPG", "video.mkv": "FFV1", "video.mp4": "mp4v"}
BOARD: dict[str, Any] = {"type": "chessboard", "columns": 8, "rows": 5, "square": 0.022}
MARKER: dict[str, Any] = {"dictionary": "4x4_50", "id": 11, "size": 0.026}
OFFSET = (0.004, -0.034)


class Motion(NamedTuple):
    """Times, s; the gripped end, shape (m, 2), and the nodes, shape (m, n, 2), x and z in the world, m; the landing."""

    t: Array
    end: Array
    nodes: Array
    landing: float


@dataclass(frozen=True)
class Design:
    """One recording, drawn at random from a number and a seed."""

    number: int
    seed: int

    @property
    def factors(self) -> dict[str, Any]:
        """What varies, SI; the height is in L*, friction, drag and viscosity in the chain's units."""
        rng = np.random.default_rng([self.seed, self.number, 1])
        speed, rate = PACES[rng.integers(len(PACES))]
        return {
            "camera": int(rng.integers(len(CAMERAS))),
            "speed": speed,
            "rate": rate,
            "file": str(rng.choice(FILES)),
            "eta_b": float(rng.uniform(0.02, 0.026) ** -3 / GRAVITY),
            "height": float(rng.uniform(3.6, 5.0)),
            "friction": float(rng.choice([0.0, 0.01, 0.02])),
            "drag": float(rng.uniform(0.08, 0.3)),
            "mirrored": bool(rng.random() < 0.5),
            "dark": bool(rng.random() < 0.5),
            "lamp": float(rng.uniform(-0.7, 0.7)),
            "sheen": float(rng.choice([0.0, 0.4])),
            "shadow": float(rng.choice([0.1, 0.5])),
            "gain": float(rng.uniform(0.5, 0.95)),
            "gamma": float(rng.choice([1.0, 0.7])),
            "width": float(rng.uniform(0.02, 0.045)),
            "recede": float(rng.uniform(0.0, 0.002)),
            "narrowing": float(rng.uniform(0.0, 0.25)),
            "twist": float(rng.uniform(0.0, 0.04)),
            "hairs": int(rng.choice([0, 150])),
            "read": float(rng.choice([0.7, 2.0])),
            "blur": float(rng.uniform(0.4, 1.1)),
            "exposure": float(rng.choice([0.002, 0.008])),
            "shutter": float(rng.choice([0.0, 0.012])),
            "vibration": float(rng.choice([0.0, 1e-5])),
            "ripple": float(rng.uniform(0.0, 0.08)),
            "clock": float(rng.uniform(-2.0, 2.0)),
        }

    def write(self, folder: Path, calibration: Path) -> dict[str, Any]:
        """Write the recording into a new folder, with a copy of its camera's calibration; its truth."""
        f, rng = self.factors, np.random.default_rng([self.seed, self.number, 2])
        camera, motion = Camera(**CAMERAS[f["camera"]]), move(f)
        folder.mkdir(parents=True)
        shutil.copytree(calibration, folder / "calibration")
        lamp = (f["lamp"], -0.6, 0.75)
        strip, table, wall = (0.12, 0.6, 0.75) if f["dark"] else (0.8, 0.25, 0.18)
        names = ("sheen", "shadow", "width", "recede", "narrowing", "twist", "hairs")
        shape = {name: f[name] for name in names}
        look = Look(strip, table, wall, lamp, thickness=1.2e-3, ground=-TARGET[1], **shape, **_marker())
        stamps = _film(folder / f["file"], Studio(camera, look, rng), motion, f, rng)
        if f["file"] == "frames":
            lines = [f"{i},{t:.6f}" for i, t in enumerate(stamps)]
            (folder / "timestamps.csv").write_text("frame,t\n" + "\n".join(lines) + "\n", encoding="utf-8")
        sign, origin = ROBOTS[f["camera"]]
        t = np.arange(-0.4, motion.t[-1] + 0.4, 0.01) + rng.uniform(0.0, 0.01)
        log = [
            np.interp(t, motion.t, motion.end[:, 0]) * sign + origin,
            np.interp(t, motion.t, motion.end[:, 1]) + TARGET[1],
        ]
        rows = np.column_stack([t + f["clock"], *log + 2e-5 * rng.standard_normal((2, len(t)))])
        np.savetxt(folder / "robot.csv", rows, "%.5f,%.5f,%.5f", header="t,x,z", comments="")
        unit, towards = _unit(f), -1.0 if f["mirrored"] else 1.0
        flat = sign * towards * (-LENGTH * unit - TARGET[0]) + origin
        told: dict[str, Any] = {
            "title": f"synthetic recording {self.number} of the chain (seed {self.seed})",
            "synthetic": True,
            "strip": {"length": round(LENGTH * unit, 6), "eta_b": f["eta_b"], "width": f["width"]},
            "gripper": {
                "height": round(f["height"] * unit, 6),
                "speed": f["speed"],
                "flat_end": float(flat),
                "flat_end_uncertainty": 0.0,
                "direction": int(sign * towards),
                "marker": {**MARKER, "offset": [sign * OFFSET[0], OFFSET[1]], "offset_uncertainty": 0.0},
            },
            "video": f["file"],
            **({"timestamps": "timestamps.csv"} if f["file"] == "frames" else {}),
            "robot_log": "robot.csv",
            "camera": {"images": "calibration/camera", "board": dict(BOARD), "rolling_shutter": f["shutter"]},
            "plane": {"image": "calibration/plane.png", "board": dict(BOARD)},
            "robot": {"grid": "calibration/robot.csv"},
        }
        (folder / "recording.yaml").write_text(yaml.safe_dump(told, sort_keys=False), encoding="utf-8")
        known = truth(motion, f["height"] * unit)
        along = abs(motion.end[:, 0] - towards * (-LENGTH * unit - TARGET[0]))
        known |= {"lambda": float(np.interp(known["onset"], motion.t, along)), "frames": len(stamps), "synthetic": True}
        start = 0.0 if f["file"] == "frames" else START
        known |= {"video_onset": known["onset"] - start, "clock_offset": f["clock"] + start}
        (folder / "truth.json").write_text(json.dumps(known | {"factors": f}), encoding="utf-8")
        return known


def move(f: dict[str, Any]) -> Motion:
    """The motion: at rest, a smooth start, an advance with a ripple and vibrations, the snap, and a smooth stop."""
    unit = _unit(f)
    clock = float(np.sqrt(unit / GRAVITY))
    limit = critical(f["height"])
    chain = Chain(LENGTH, Hinges(f["drag"], friction=f["friction"]))
    before = float(np.clip(f["speed"] * (110.0 / f["rate"] - 2.0), 0.006, 0.025)) / unit
    begin = limit - before
    chain.prepare(begin, f["height"])
    every = round(1.0 / (RATE * clock * STEP))
    block, place, stop, landing, t, states = every * 50, begin, np.inf, np.nan, 0.0, []
    advances: list[Array] = []
    while t < stop + 0.6 / clock:
        times = t + STEP * np.arange(1, block + 1)
        seconds = times * clock
        ramp = np.clip((seconds - 0.4) / 0.3, 0.0, 1.0) - np.clip((times - stop) * clock / 0.2, 0.0, 1.0)
        speed = f["speed"] * clock / unit * ramp**2 * (3.0 - 2.0 * ramp) * (1.0 + f["ripple"] * np.sin(2.3 * seconds))
        steady = place + STEP * np.cumsum(speed)
        advance = steady + f["vibration"] / unit * np.sin(2.0 * np.pi * 13.0 * seconds)
        place, t = float(steady[-1]), float(times[-1])
        height = f["height"] + 0.5 * (advance - steady)
        states.append(chain.follow(advance, height, every))
        advances.append(np.column_stack([advance, height])[every - 1 :: every])
        landed = chain.sag(states[-1]) < 1.05 * chain.hinges.thickness
        if np.isnan(landing) and landed.any():
            landing = t - STEP * every * (len(landed) - int(np.argmax(landed)) - 1)
            stop = t + 0.5 / clock
        if place > limit + 2.0:
            raise ValueError("the strip does not snap within 2 L*")
    nodes: Array = np.concatenate(states) * unit - TARGET
    nodes[..., 0] *= -1.0 if f["mirrored"] else 1.0
    kept: Array = STEP * every * clock * np.arange(1.0, len(nodes) + 1.0)
    return Motion(kept, nodes[:, 0], nodes, landing * clock)


def truth(motion: Motion, height: float) -> dict[str, float]:
    """Onset of the snap, s: half-way in the rise of the kinetic energy's root; and when the upper layer lands.

    The energy is that of the nodes which are raised at the beginning; the rise is from its median while the strip
    follows the gripper to its first peak: its maximum before it has halved, once the layers touch.
    """
    z = motion.nodes[0, :, 1] + TARGET[1]
    raised = np.cumsum(z < 0.1 * height) == 0
    rates = np.gradient(motion.nodes[:, raised], motion.t, axis=0)
    speed = np.sqrt(np.mean(np.sum(rates**2, axis=2), axis=1))
    # The gripper advances steadily from 0.7 s on; then the strip swings for a while.
    used = motion.t > 1.0
    t, speed = motion.t[used], speed[used]
    ended = np.flatnonzero((t > motion.landing) & (speed < 0.5 * np.maximum.accumulate(speed)))
    peak = int(np.argmax(speed[: int(ended[0])] if len(ended) else speed))
    following = float(np.median(speed[: max(int(0.4 * peak), 1)]))
    level = 0.5 * (following + speed[peak])
    i = int(np.flatnonzero(speed[:peak] < level)[-1])
    onset = t[i] + (t[i + 1] - t[i]) * (level - speed[i]) / (speed[i + 1] - speed[i])
    return {"onset": float(onset), "landing": motion.landing, "following": following, "peak": float(speed[peak])}


def write_calibration(number: int, seed: int, kept: Path) -> None:
    """Render the calibration of a camera into a new folder."""
    camera, rng = Camera(**CAMERAS[number]), np.random.default_rng([seed, number, 3])
    look = Look(0.8, 0.4, 0.3, (0.3, -0.6, 0.75), 0.0, 0.0, 0.03, 1e-3, 0.0, 0.0, 0.0, 0, **_marker())
    studio, sign, origin = Studio(camera, look, rng), *ROBOTS[number]
    wide, tall = CAMERAS[number]["field"], CAMERAS[number]["field"] * 0.75

    def save(name: str, canvas: Any) -> None:
        noise = rng.standard_normal(CAMERAS[number]["size"][::-1]).astype(np.float32)
        cv2.imwrite(str(kept / name), exposed(camera.seen(canvas, 0.6), 0.8, 1.0, noise, 1.0, 0.7))

    def board(middle: Array, turn: Array) -> Any:
        axes = np.asarray(cv2.Rodrigues(turn)[0]) @ np.array([[1.0, 0.0], [0.0, 0.0], [0.0, -1.0]])
        return studio.board(9, 6, BOARD["square"], axes[:, 0], axes[:, 1], middle)

    for name in ("camera", "stops"):
        (kept / name).mkdir(parents=True)
    for i in range(10):
        around = 2.0 * np.pi * i / 10.0 + rng.uniform(-0.2, 0.2)
        spot = 0.16 * np.array([wide * np.sign(np.cos(around + 0.1)), 0.0, tall * np.sign(np.sin(around + 0.1))])
        spot[1] = rng.uniform(-0.02, 0.12)
        lean = np.radians(rng.uniform(18.0, 33.0)) * np.array([np.cos(3.0 * around), 0.0, np.sin(3.0 * around)])
        save(f"camera/{i:02d}.png", board(spot * (i > 1), lean))
    save("plane.png", board(np.array([0.01, 0.0, 0.005]), np.array([0.0, 0.03, 0.0])))
    rows = ["image,x,z"]
    for i, (u, v) in enumerate(np.stack(np.meshgrid([-0.36, 0.0, 0.36], [-0.22, 0.08, 0.36]), axis=-1).reshape(-1, 2)):
        x, z = u * wide, v * tall
        canvas = studio.empty()
        studio.gripper(canvas, np.array([x, z]) + OFFSET)
        save(f"stops/{i}.png", canvas)
        x, z = np.array([sign * x + origin, z + TARGET[1]]) + 4e-5 * rng.standard_normal(2)
        rows.append(f"stops/{i}.png,{x:.6f},{z:.6f}")
    (kept / "robot.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")


def _film(path: Path, studio: Studio, motion: Motion, f: dict[str, Any], rng: np.random.Generator) -> list[float]:
    """Write the film; the time stamps: the middle of the exposure of each frame's first row, s."""
    camera, uneven = studio.camera, f["file"] == "frames"
    width, height = camera.size
    noise = rng.standard_normal((height + 64, width + 64)).astype(np.float32)
    stamps = np.arange(START, motion.t[-1] - f["shutter"] - 0.02, 1.0 / f["rate"])
    stamps += uneven * rng.uniform(-0.15, 0.15, len(stamps)) / f["rate"]
    film = None
    if uneven:
        path.mkdir()
    else:
        film = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*CODECS[path.name]), f["rate"], camera.size, False)
        if not film.isOpened():
            raise OSError(f"{path} cannot be written")
    for i, stamp in enumerate(stamps):
        light = _exposure(studio, motion, stamp, f)
        x, y = rng.integers(0, 64, 2)
        picture = exposed(light, f["gain"], f["gamma"], noise[y : y + height, x : x + width], f["read"], 1.0)
        if film is None:
            cv2.imwrite(str(path / f"{i:05d}.png"), picture)
        else:
            film.write(picture)
    if film is not None:
        film.release()
        stamps = stamps - stamps[0]
    return list(stamps)


def _exposure(studio: Studio, motion: Motion, stamp: float, f: dict[str, Any]) -> Light:
    """The light of a frame: each row is the mean over its own exposure of pictures at a few times."""
    begin, end = stamp - 0.5 * f["exposure"], stamp + f["shutter"] + 0.5 * f["exposure"]
    first, last = (_state(motion, t) for t in (begin, end))
    moved = float(np.abs(last - first).max()) * studio.camera.focal / float(np.linalg.norm(studio.camera.place))
    count = int(np.clip(np.ceil(moved / 0.35), 1, 7))
    edges = np.linspace(begin, end, count + 1)
    height = studio.camera.size[1]
    middle = stamp + f["shutter"] * np.arange(height) / (height - 1)
    light = np.zeros((height, studio.camera.size[0]), np.float32)
    for low, high in pairwise(edges):
        state = _state(motion, 0.5 * (low + high))
        seen = studio.camera.seen(studio.frame(state, state[0]), f["blur"])
        share = np.minimum(high, middle + 0.5 * f["exposure"]) - np.maximum(low, middle - 0.5 * f["exposure"])
        light += (np.maximum(share, 0.0) / f["exposure"]).astype(np.float32)[:, None] * seen
    return light


def _state(motion: Motion, t: float) -> Array:
    i = int(np.clip(np.searchsorted(motion.t, t), 1, len(motion.t) - 1))
    share = np.clip((t - motion.t[i - 1]) / (motion.t[i] - motion.t[i - 1]), 0.0, 1.0)
    return np.asarray((1.0 - share) * motion.nodes[i - 1] + share * motion.nodes[i])


def _unit(f: dict[str, Any]) -> float:
    """L*, m."""
    return float((f["eta_b"] * GRAVITY) ** (-1.0 / 3.0))


def _marker() -> dict[str, Any]:
    return {"marker": MARKER["id"], "marker_size": MARKER["size"], "offset": OFFSET}
