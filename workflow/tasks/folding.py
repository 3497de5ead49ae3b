"""Folding paths, and the internal friction that the R-path needs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import av
import numpy as np
import xarray as xr
from matplotlib import font_manager
from PIL import Image, ImageDraw, ImageFont

from stripfold import Strip
from stripfold.ask.collapse import in_solver_units
from stripfold.ask.inputs import Release
from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.draw import film as drawn
from stripfold.files import schema
from stripfold.paths import low
from stripfold.paths import triangular as triangular_path
from stripfold.paths.curve import GripperPath
from stripfold.paths.geometric import circular, triangular
from stripfold.paths.rpath import RPath, plan_r_path
from tasks import assess_data, material_of, post_critical
from tasks import friction as needed_friction
from tasks.assess_data import PATHS

PLACES = 201
"""Gripper places on each path: as many segments on each of its pieces, so that every corner is among them."""
NODES = 401


def plans(material: Mapping[str, Any], gravity: float) -> xr.Dataset:
    """Plan the paper's paths: gripper paths and assumed states over ``path``, ``place`` and ``node``, 0 the gripper's.

    Triangular: the strip hangs straight down from the gripper, no stiffness, and nothing slides.  Circular: two rigid
    halves with a hinge.  R-path: the elastica's states.  The first state is the flat strip, the R-path's last one the
    folded strip.

    Raises InvalidInputError, SolveError: as in :func:`.plan_r_path`.
    """
    strip, length = material_of(material, gravity), material["length"]
    unit = strip.gravity_length
    long = length / unit
    plan = plan_r_path(long)
    s = np.linspace(0.0, long, NODES)
    paths = {"r-path": plan.path, "triangular": triangular(long), "circular": circular(long)}
    travelled = np.array([_places(paths[name]) for name in PATHS])
    times = np.array([[paths[name].pseudo_time(t) for t in row] for name, row in zip(PATHS, travelled, strict=True)])
    states = np.array(
        [[assumed(name, plan, long, t, s) for t in row] for name, row in zip(PATHS, travelled, strict=True)]
    )
    on = ("path", "place")
    values = {
        "travelled": (on, travelled),
        "pseudo_time": (on, times),
        "x": ((*on, "node"), states[..., 0]),
        "z": ((*on, "node"), states[..., 1]),
        "arc": ("node", s),
        "path": ("path", PATHS),
    }
    attrs = {
        **strip.attributes,
        "length": length,
        "lying_length": unit * plan.lying_length,
        "planned_touch_x": unit * plan.first_touch,
        "landing_x": unit * plan.landing,
    }
    title = f"folding paths as planned, {material['label']}"
    return schema.dataset(values, attrs, strip.scales).assign_attrs(title=title)


def _places(path: GripperPath) -> Array:
    """Lengths travelled, L*: evenly spaced on each piece."""
    count = (PLACES - 1) // len(path.pieces)
    return np.concatenate([[0.0], *(np.linspace(piece.start, piece.end, count + 1)[1:] for piece in path.pieces)])


def assumed(name: str, plan: RPath, length: float, travelled: float, s: Array) -> Array:
    """Assumed places (x, z), shape (n, 2), of the distances ``s``, shape (n,), from the grasped end; L*."""
    if name == "r-path":
        return plan.mid_surface(travelled, s)
    flat = np.stack([s - length / 2.0, np.zeros_like(s)], axis=1)
    upper = s < length / 2.0
    if name == "circular":
        angle = travelled / (length / 2.0)
        arm = length / 2.0 - s
        turned = np.stack([-arm * np.cos(angle), arm * np.sin(angle)], axis=1)
        return np.where(upper[:, None], turned, flat)
    x, z = triangular(length).position(travelled)
    # The hanging part is as long as the gripper is high; the rest lies flat, or on the lower layer past the fold line.
    hanging = np.stack([np.full_like(s, x), np.maximum(z - s, 0.0)], axis=1)
    folded = np.stack([np.minimum(length / 2.0 - s, x), np.maximum(z - s, 0.0)], axis=1)
    return np.where(((s < z) if x <= 0.0 else upper)[:, None], hanging if x <= 0.0 else folded, flat)


def assess(
    material: Mapping[str, Any],
    gravity: float,
    refinement: float,
    paths: Sequence[str],
    progress: Callable[[str], None],
) -> list[xr.Dataset]:
    """A material along each of the paper's folding paths."""
    strip = material_of(material, gravity)
    fall = in_solver_units(Release(), strip)
    found = [assess_data.run(strip, material["length"], path, fall, refinement, progress) for path in paths]
    return [
        data.assign_attrs(title=f"{path} path, {material['label']}") for path, data in zip(paths, found, strict=True)
    ]


def assessment(
    runs: Sequence[xr.Dataset],
    friction: Sequence[xr.Dataset],
    ways: Sequence[xr.Dataset],
    labels: Mapping[str, str],
    paths: Sequence[str],
) -> list[xr.Dataset]:
    """The tables of all assessments, and of the friction that R-paths need."""
    with_friction, without = (dict(zip(labels, of, strict=True)) for of in (friction, ways))
    return [
        assess_data.table(dict(zip(product(labels, paths), runs, strict=True)), labels).assign_attrs(
            title="folding paths assessed"
        ),
        needed_friction.table(with_friction, without, labels).assign_attrs(title="friction that an R-path needs"),
    ]


def films(
    material: Mapping[str, Any],
    gravity: float,
    rate: int,
    collapse: xr.Dataset,
    output: Any,
    progress: Callable[[str], None],
) -> None:
    """The films of the collapse and of a material on its low path, and the moving picture of the README.

    ``rate``: frames per second.
    """
    drawn.FPS = rate
    drawn.film(collapse, output.collapse)
    strip = strip_of(material, gravity)
    low_path_film(strip, output.low_path, progress)
    two_folds(strip, output.low_path, output.two_folds, progress)


def low_path_film(strip: Strip, output: str, progress: Callable[[str], None]) -> None:
    """Film a strip that is carried over on the low path at the height of L*."""
    found = strip.assess(low(strip, strip.gravity_length), model="rod", progress=progress)
    if not (found.stable and found.completed):
        raise SolveError("the strip does not follow its low path")
    found.film(output, progress)


SHRUNK, EACH, COLOURS = 480, 4, 48
"""Width of one half of the moving picture, pixels; of the films' frames each such one is shown; colours."""


def two_folds(strip: Strip, low_film: str, output: str, progress: Callable[[str], None]) -> None:
    """Draw a strip on its triangular path beside the film of its low one, as a moving picture for the README."""
    with TemporaryDirectory() as folder:
        film = Path(folder, "film.mp4")
        strip.assess(triangular_path(strip), model="rod", fall=True, progress=progress).film(film, progress)
        halves = {"triangular path: snaps": _shrunk(film), "low path: does not": _shrunk(low_film)}
    high = max(frames[0].height for frames in halves.values()) + 24
    font = ImageFont.truetype(font_manager.findfont("DejaVu Sans"), 15)
    pictures = []
    # The end stays for a second and a half.
    for i in range(max(len(frames) for frames in halves.values()) + 12):
        picture = Image.new("RGB", (2 * SHRUNK + 10, high), "white")
        for left, (text, frames) in zip((0, SHRUNK + 10), halves.items(), strict=True):
            frame = frames[min(i, len(frames) - 1)]
            picture.paste(frame, (left, high - frame.height))
            ImageDraw.Draw(picture).text((left + 40, high - frame.height - 22), text, fill="black", font=font)
        pictures.append(picture.quantize(COLOURS, dither=Image.Dither.NONE))
    pictures[0].save(output, save_all=True, append_images=pictures[1:], duration=33 * EACH, loop=0, optimize=True)


def _shrunk(film: str | Path) -> list[Image.Image]:
    """Every :data:`EACH`-th frame of a film."""
    with av.open(film) as container:
        frames = [frame.to_image() for i, frame in enumerate(container.decode(video=0)) if i % EACH == 0]
    return [frame.resize((SHRUNK, SHRUNK * frame.height // frame.width)) for frame in frames]


def strip_of(material: Mapping[str, Any], gravity: float) -> Strip:
    """The strip of a material, as a user has it."""
    known = {
        name: getattr(material_of(material, gravity), name) for name in ("eta_b", "eta_m", "nu", "rho_a", "gravity")
    }
    return Strip(length=material["length"], **known)


def friction(
    material: Mapping[str, Any],
    gravity: float,
    refinement: float,
    friction_refinement: float,
    step: float,
    progress: Callable[[str], None],
) -> list[xr.Dataset]:
    """The smallest internal friction with which a material follows its R-path; its post-critical branches without."""
    strip, length = material_of(material, gravity), material["length"]
    fall = in_solver_units(Release(), strip)
    needed = needed_friction.run(strip, length, step, friction_refinement, progress)
    ways = post_critical.two_ways(strip, length, fall, refinement, progress)
    return [
        needed.assign_attrs(title=f"R-path with friction, {material['label']}"),
        ways.assign_attrs(title=f"two ways out of an R-path, {material['label']}"),
    ]
