"""Whether the gripper's path decides the finished fold: four paths with Coulomb friction between the layers.

Each path is followed in time from the flat strip to rest at its end; then the gripper opens.  The error of the fold is
its largest distance from the accurate one.  Lengths in L*, energies per width in rho_a g L*^2.
Source: docs/physics.md, section 8.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import Any

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.follow.statics import StripModel
from stripfold.follow.time import SPEED, TIME_OPTIONS, dissipated, follow_in_time, opened
from stripfold.follow.track import Track, mid_surfaces, nodes, shape_error
from stripfold.paths.curve import GripperPath
from stripfold.paths.geometric import circular, triangular
from stripfold.paths.low_path import low
from stripfold.paths.rpath import plan_r_path
from stripfold.solve.schemes import Damping
from verification.common import Progress, dataset, grid, pooled
from verification.numbers import Facts, Number

PATHS = ("r-path", "triangular", "circular", "low")
LOW = 1.2
"""Height of the low path, L*."""
VALUES = ("error", "opened_error", "edge", "loop", "touch_x", "dissipated", "created")
DAMPING = Damping(air=0.1, stiffness=0.06)
"""Air drag of 2 /s and viscosity of 3 ms with L* = 2.5 cm."""
HALF_STEP = 1.0 / 8.0
"""Factor on the estimated error of a time step: steps half as long."""
LOOP_SPACING = 0.01


def run(
    length_star: float = 14.0,
    thickness: float = 0.05,
    moment: float = 0.02,
    coefficients: Sequence[float] = (0.0, 0.2, 0.4, 0.6),
    shown: float = 0.4,
    band: Sequence[float] = (0.2, 0.6),
    long: float = 24.0,
    fabric_moment: float = 0.3,
    speeds: Sequence[float] = (0.4,),
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Folds over ``path`` and ``mu``.

    Parameters
    ----------
    length_star, thickness
        The strip, a rod, L*.
    moment
        M_0 of the bending hysteresis, with which the R-path is followed, rho_a g L*^2.
    coefficients
        Coefficients of friction.
    shown
        The one at which elements and time steps half as long are used as well, for the error.
    band
        Coefficients of fabrics: from, to.
    long
        Length of a longer strip, at ``shown``, with the hysteresis on each path and without it on the R-path.
    fabric_moment
        M_0 of fabrics, at ``shown``.
    speeds
        Other speeds of the gripper, sqrt(g L*), at ``shown``.
    """
    case = partial(_numbers, length=length_star, thickness=thickness, moment=moment)
    values = grid(case, VALUES, {"path": PATHS, "mu": list(coefficients)}, threads, progress)
    halved = [partial(_finer, name, shown, length_star, thickness, moment) for name in PATHS]
    longer = [partial(case, name, shown, length=long) for name in PATHS]
    without = partial(case, "r-path", shown, length=long, moment=0.0)
    fabric = [partial(case, name, shown, moment=fabric_moment) for name in PATHS]
    other = [partial(case, name, shown, speed=speed) for name in PATHS for speed in speeds]
    more: list[Callable[[], Any]] = [*halved, *longer, without, *fabric, *other]
    found = iter(pooled(operator.call, more, threads))
    errors, shapes = zip(*islice(found, len(PATHS)), strict=True)
    longer_numbers, without_numbers = list(islice(found, len(PATHS))), next(found)
    fabric_numbers = list(islice(found, len(PATHS)))
    speed_errors = np.array([one["error"] for one in found]).reshape(len(PATHS), -1)
    return dataset(
        {
            **values,
            "long_error": ("path", [one["error"] for one in longer_numbers]),
            "long_edge": ("path", [one["edge"] for one in longer_numbers]),
            "long_error_without": ((), without_numbers["error"]),
            "fabric_error": ("path", [one["error"] for one in fabric_numbers]),
            "finer_error": ("path", list(errors)),
            "gripper_speed": ("gripper_speed", list(speeds)),
            "speed_error": (("path", "gripper_speed"), speed_errors),
            "arc": ("node", nodes(length_star)),
            "x": (("path", "node"), np.stack(shapes)[..., 0]),
            "z": (("path", "node"), np.stack(shapes)[..., 1]),
        },
        {
            "length_star": length_star,
            "thickness": thickness,
            "moment": moment,
            "shown": shown,
            "band": list(band),
            "long": long,
            "fabric_moment": fabric_moment,
        },
    )


def path_of(name: str, length: float) -> GripperPath:
    """A path of a strip of this length, L*."""
    if name == "r-path":
        return plan_r_path(length).path
    if name == "low":
        return low(length, LOW)
    return triangular(length) if name == "triangular" else circular(length)


def _fold(
    name: str, mu: float, length: float, thickness: float, moment: float, finer: bool = False, speed: float = SPEED
) -> tuple[Track, Track]:
    """The strip at rest with the gripper closed, and after it has opened."""
    return _follow(path_of(name, length), mu, length, thickness, moment, finer, speed)


def _follow(
    path: GripperPath,
    mu: float,
    length: float,
    thickness: float,
    moment: float,
    finer: bool = False,
    speed: float = SPEED,
) -> tuple[Track, Track]:
    strip = StripModel(length, thickness, kind="rod")
    refinement, options = 1.0, TIME_OPTIONS
    if finer:
        refinement, options = 0.5, replace(options, tolerance=HALF_STEP * options.tolerance)
    closed = follow_in_time(
        strip, path, mu, moment, damping=DAMPING, speed=speed, refinement=refinement, options=options
    )
    return closed, opened(closed, DAMPING, options)


def _finer(name: str, mu: float, length: float, thickness: float, moment: float) -> tuple[float, Array]:
    """Error and shape of the closed fold with elements and time steps half as long."""
    closed, _ = _fold(name, mu, length, thickness, moment, finer=True)
    return _error(length, closed), mid_surfaces(closed.states[-1:], nodes(length))[0]


def _numbers(
    name: str, mu: float, *, length: float, thickness: float, moment: float, speed: float = SPEED
) -> dict[str, float]:
    closed, after = _fold(name, mu, length, thickness, moment, speed=speed)
    place = mid_surfaces(after.states[-1:], np.arange(0.0, length, LOOP_SPACING))[0]
    accurate = length / 2.0 - elastica.half_fold_lying_length(length) - elastica.folded_loop().bulge
    return {
        "error": _error(length, closed),
        "opened_error": _error(length, after),
        "edge": float(place[0, 0]) - length / 2.0,
        "loop": float(place[:, 0].min()) - accurate,
        "touch_x": closed.touch_x,
        "dissipated": float(dissipated(after)[-1]),
        "created": _created(closed, after),
    }


def _error(length: float, fold: Track) -> float:
    return shape_error(*fold.states[-1], plan_r_path(length))


def _created(*parts: Track) -> float:
    """Energy that appears from nowhere: where friction gives some, and where the balance does not close."""
    given: Array = np.concatenate([np.diff(dissipated(part)) for part in parts])
    return float(np.maximum(-given, 0.0).sum()) + max(max(part.moments[-1].energy.closing, 0.0) for part in parts)


OFF = 0.1
"""Error of a fold that is not accurate, L*."""


def facts(d: xr.Dataset) -> Facts:
    """Errors of the folds at the coefficient shown, and from which coefficient on a path does not fold accurately."""
    at = d.sel(mu=d.attrs["shown"])
    errors = {path: float(at.error.sel(path=path)) for path in d.path.values}
    wrong = d.error.sel(path="circular") > OFF
    first = int(wrong.values.argmax())
    low, high = d.attrs["band"]
    from_, to = float(d.mu[max(first - 1, 0)]), float(d.mu[first])
    return {
        "mu": d.attrs["shown"],
        "length": d.attrs["length_star"],
        "moment": d.attrs["moment"],
        "circular": errors["circular"],
        "r_path": errors["r-path"],
        "triangular": errors["triangular"],
        # Of mesh and gripper: what varies in the user's world belongs to the error.
        "finer": abs(float(at.finer_error.sel(path="circular")) - errors["circular"]),
        "varies": max(
            abs(float(x) - errors["circular"])
            for x in (at.finer_error.sel(path="circular"), *d.speed_error.sel(path="circular"))
        ),
        "speeds": ", ".join(
            f"{float(x):.2f} at {float(v):g}"
            for x, v in zip(d.speed_error.sel(path="circular"), d.gripper_speed, strict=True)
        ),
        "edge": at.edge.sel(path="circular"),
        "without": d.error.sel(mu=0.0).max(),
        "r_path_most": d.error.sel(path="r-path").max(),
        "triangular_most": d.error.sel(path="triangular").max(),
        "from_": from_,
        "to": to,
        "band_low": low,
        "band_high": high,
        "in_band": bool(wrong.sel(mu=slice(low, high)).all()),
        "long": d.attrs["long"],
        "long_circular": d.long_error.sel(path="circular"),
        "long_r_path": d.long_error.sel(path="r-path"),
        "long_triangular": d.long_error.sel(path="triangular"),
        "long_r_path_without": d.long_error_without,
        "fabric_moment": d.attrs["fabric_moment"],
        "fabric": d.fabric_error.sel(path="circular"),
        "fabric_r_path": d.fabric_error.sel(path="r-path"),
        "fabric_triangular": d.fabric_error.sel(path="triangular"),
        "created": d.created.max(),
        "runs": d.created.size,
        "dissipated": d.dissipated.max(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("fold_error_mu", "circular", "L*",
            "> 0.1 L* on the circular path at all coefficients of fabrics; < 0.05 L* on the R-path at all, and on all "
            "paths without friction",
            "distance of the finished fold of the circular path from the accurate one with a coefficient of friction "
            "of {mu:g} between the layers, gripper closed, length {length:g} L*, M_0 = {moment:g} rho_a g L*^2 "
            "({r_path:.3f} on the R-path, {triangular:.3f} on the triangular one; {without:.3f} at most without "
            "friction), the gripper at 0.2 sqrt(g L*); at other speeds {speeds}, with half the elements and steps "
            "{finer:.3f} off. It is off from a coefficient between {from_:g} and {to:g} on, fabrics have {band_low:g} "
            "to {band_high:g}; after the gripper has opened its end is {edge:.2f} L* past the edge. Length {long:g} "
            "L*: {long_circular:.2f}, R-path {long_r_path:.3f} ({long_r_path_without:.2f} without internal friction), "
            "triangular {long_triangular:.3f}",
            lambda f: f.in_band and max(f.r_path_most, f.without) < 0.05, "varies"),
        Number("fold_error_fabric", "fabric", "L*", "> 1 L*, on the R-path < 0.1 L*",
            "the same with M_0 = {fabric_moment:g} rho_a g L*^2, as fabrics have ({fabric_r_path:.3f} on the R-path, "
            "{fabric_triangular:.3f} on the triangular one)", lambda f: f.fabric_r_path < 0.1),
        Number("layer_friction_energy", "created", "rho_a g L*^2", "< 1e-6",
            "largest energy that stick and slip and the defect of the balance made in a fold, of {runs}; friction "
            "between the layers took up to {dissipated:.2g}", lambda f: f.runs >= 15),
    ),
}
# fmt: on
