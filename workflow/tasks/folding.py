"""Folding paths, and the internal friction that the R-path needs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import av
import xarray as xr
from matplotlib import font_manager
from PIL import Image, ImageDraw, ImageFont

from stripfold import Strip
from stripfold.ask import collapse
from stripfold.ask.inputs import Release
from stripfold.base.errors import SolveError
from stripfold.paths import low, triangular
from tasks import assess_data, post_critical
from tasks import friction as needed_friction
from tasks import plans as planned
from tasks.materials import material_of


def plans(material: Mapping[str, Any], gravity: float) -> xr.Dataset:
    """The folding paths of a material as planned."""
    data = planned.dataset(material_of(material, gravity), material["length"])
    return data.assign_attrs(title=f"folding paths as planned, {material['label']}")


def assess(
    material: Mapping[str, Any],
    gravity: float,
    refinement: float,
    paths: Sequence[str],
    progress: Callable[[str], None],
) -> list[xr.Dataset]:
    """A material along each of the paper's folding paths."""
    strip = material_of(material, gravity)
    fall = collapse.in_solver_units(Release(), strip)
    found = [assess_data.run(strip, material["length"], path, fall, refinement, progress) for path in paths]
    return [
        data.assign_attrs(title=f"{path} path, {material['label']}") for path, data in zip(paths, found, strict=True)
    ]


def assessment(runs: Sequence[xr.Dataset], labels: Mapping[str, str], paths: Sequence[str]) -> xr.Dataset:
    """The table of all assessments."""
    return assess_data.table(dict(zip(product(labels, paths), runs, strict=True)), labels)


def low_path_film(
    material: Mapping[str, Any], gravity: float, output: Sequence[str], progress: Callable[[str], None]
) -> None:
    """A material carried over on the low path at the height of L*, as a film."""
    strip = strip_of(material, gravity)
    found = strip.assess(low(strip, strip.gravity_length), model="rod", progress=progress)
    if not (found.stable and found.completed):
        raise SolveError("the strip does not follow its low path")
    found.film(output[0], progress)


SHRUNK, EACH, COLOURS = 480, 4, 48
"""Width of one half of the moving picture, pixels; of the films' frames each such one is shown; colours."""


def two_folds(
    material: Mapping[str, Any], gravity: float, output: Sequence[str], progress: Callable[[str], None]
) -> None:
    """Draw a material on its triangular path beside the same on a low one, as a moving picture for the README."""
    strip = strip_of(material, gravity)
    halves = []
    for text, path in (
        ("triangular path: snaps", triangular(strip)),
        ("low path: does not", low(strip, strip.gravity_length)),
    ):
        with TemporaryDirectory() as folder:
            film = Path(folder, "film.mp4")
            strip.assess(path, model="rod", fall=True, progress=progress).film(film, progress)
            with av.open(film) as container:
                frames = [frame.to_image() for i, frame in enumerate(container.decode(video=0)) if i % EACH == 0]
        halves.append((text, [frame.resize((SHRUNK, SHRUNK * frame.height // frame.width)) for frame in frames]))
    high = max(frames[0].height for _, frames in halves) + 24
    font = ImageFont.truetype(font_manager.findfont("DejaVu Sans"), 15)
    pictures = []
    # The end stays for a second and a half.
    for i in range(max(len(frames) for _, frames in halves) + 12):
        picture = Image.new("RGB", (2 * SHRUNK + 10, high), "white")
        for left, (text, frames) in zip((0, SHRUNK + 10), halves, strict=True):
            frame = frames[min(i, len(frames) - 1)]
            picture.paste(frame, (left, high - frame.height))
            ImageDraw.Draw(picture).text((left + 40, high - frame.height - 22), text, fill="black", font=font)
        pictures.append(picture.quantize(COLOURS, dither=Image.Dither.NONE))
    pictures[0].save(output[0], save_all=True, append_images=pictures[1:], duration=33 * EACH, loop=0, optimize=True)


def strip_of(material: Mapping[str, Any], gravity: float) -> Strip:
    """The strip of a material, as a user has it."""
    known = {
        name: getattr(material_of(material, gravity), name) for name in ("eta_b", "eta_m", "nu", "rho_a", "gravity")
    }
    return Strip(length=material["length"], **known)


def friction(
    material: Mapping[str, Any], gravity: float, refinement: float, step: float, progress: Callable[[str], None]
) -> xr.Dataset:
    """The smallest internal friction with which a material follows its R-path."""
    data = needed_friction.run(material_of(material, gravity), material["length"], step, refinement, progress)
    return data.assign_attrs(title=f"R-path with friction, {material['label']}")


def two_ways(
    material: Mapping[str, Any], gravity: float, refinement: float, progress: Callable[[str], None]
) -> xr.Dataset:
    """The two post-critical branches of a material's R-path without friction."""
    strip = material_of(material, gravity)
    fall = collapse.in_solver_units(Release(), strip)
    data = post_critical.two_ways(strip, material["length"], fall, refinement, progress)
    return data.assign_attrs(title=f"two ways out of an R-path, {material['label']}")


def friction_table(runs: Sequence[xr.Dataset], ways: Sequence[xr.Dataset], labels: Mapping[str, str]) -> xr.Dataset:
    """The table of the friction that R-paths need."""
    return needed_friction.table(dict(zip(labels, runs, strict=True)), dict(zip(labels, ways, strict=True)), labels)
