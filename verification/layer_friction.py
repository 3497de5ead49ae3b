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
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import PATH_LOOKS, PATH_STYLES, Look, entry, note, path_entries
from stripfold.base.arrays import Array
from stripfold.draw.colours import GREEN, GREY, SHADE
from stripfold.draw.style import figure, legend_above, styled
from stripfold.follow.statics import StripModel
from stripfold.follow.time import SPEED, TIME_OPTIONS, dissipated, follow_in_time, opened
from stripfold.follow.track import Track, mid_surfaces, nodes, shape_error
from stripfold.paths.geometric import circular, triangular
from stripfold.paths.low_path import low
from stripfold.paths.rpath import plan_r_path
from stripfold.solve.schemes import Damping
from verification.common import Progress, dataset, grid, pooled
from verification.numbers import Facts, Number

PATHS = ("r-path", "triangular", "circular", "low")
GEOMETRIC = {"triangular": triangular, "circular": circular}
LOW = 1.2
"""Height of the low path, L*."""
VALUES = ("error", "edge", "dissipated", "created")
DAMPING = Damping(air=0.1, stiffness=0.06)
"""Air drag of 2 /s and viscosity of 3 ms with L* = 2.5 cm."""
HALF_STEP = 1.0 / 8.0
"""Factor on the estimated error of a time step: steps half as long."""


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
    finer: Sequence[str] = ("circular",),
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Errors of the fold over ``path`` and ``mu``; lengths in L*, M_0 in rho_a g L*^2, speeds in sqrt(g L*).

    ``shown``: coefficient of the folds that are drawn, and of all that follow.  ``band``: that of fabrics, from and to.
    ``long``: another length; on the R-path without hysteresis, too.  ``speeds``: others, on the circular path.
    ``finer``: paths that are computed with elements and time steps half as long, too.
    """
    fold = partial(_numbers, length=length_star, thickness=thickness, moment=moment)
    values = grid(fold, VALUES, {"path": PATHS, "mu": list(coefficients)}, threads, progress)
    at = {name: partial(fold, name, shown) for name in PATHS}
    asked: dict[str, list[Callable[[], Any]]] = {
        "long": [partial(at[name], length=long) for name in PATHS],
        "without": [partial(at["r-path"], length=long, moment=0.0)],
        "fabric": [partial(at[name], moment=fabric_moment) for name in PATHS],
        "finer": [partial(at[name], finer=True) for name in finer],
        "speed": [partial(at["circular"], speed=speed) for speed in speeds],
        "shape": [partial(_shape, name, shown, length_star, thickness, moment) for name in PATHS],
    }
    found = iter(pooled(operator.call, [call for calls in asked.values() for call in calls], threads))
    of = {name: [next(found) for _ in calls] for name, calls in asked.items()}
    errors = {name: [one["error"] for one in of[name]] for name in asked if name != "shape"}
    refined = dict(zip(finer, errors["finer"], strict=True))
    shapes = np.stack(of["shape"])
    return dataset(
        {
            **values,
            "long_error": ("path", errors["long"]),
            "long_error_without": ((), errors["without"][0]),
            "fabric_error": ("path", errors["fabric"]),
            "finer_error": ("path", [refined.get(name, np.nan) for name in PATHS]),
            "gripper_speed": ("gripper_speed", list(speeds)),
            "speed_error": ("gripper_speed", errors["speed"]),
            "x": (("path", "node"), shapes[..., 0]),
            "z": (("path", "node"), shapes[..., 1]),
        },
        {
            "length_star": length_star,
            "moment": moment,
            "shown": shown,
            "band": list(band),
            "long": long,
            "fabric_moment": fabric_moment,
        },
    )


def _closed(
    name: str, mu: float, length: float, thickness: float, moment: float, speed: float = SPEED, finer: bool = False
) -> Track:
    """The strip at rest with the gripper closed."""
    r_path = name == "r-path"
    path = plan_r_path(length).path if r_path else low(length, LOW) if name == "low" else GEOMETRIC[name](length)
    options = replace(TIME_OPTIONS, tolerance=HALF_STEP * TIME_OPTIONS.tolerance) if finer else TIME_OPTIONS
    strip, refinement = StripModel(length, thickness, kind="rod"), 0.5 if finer else 1.0
    return follow_in_time(strip, path, mu, moment, damping=DAMPING, speed=speed, refinement=refinement, options=options)


def _shape(name: str, mu: float, length: float, thickness: float, moment: float) -> Array:
    closed = _closed(name, mu, length, thickness, moment)
    return mid_surfaces(closed.states[-1:], nodes(length))[0]


def _numbers(name: str, mu: float, *, length: float, thickness: float, moment: float, **how: Any) -> dict[str, float]:
    """Error of the closed fold; place of its end after the gripper has opened, over the edge; energies."""
    closed = _closed(name, mu, length, thickness, moment, **how)
    after = opened(closed, DAMPING, TIME_OPTIONS)
    end = mid_surfaces(after.states[-1:], np.zeros(1))[0][0]
    # What appears from nowhere: where friction gives some, and where the balance does not close.
    given: Array = np.concatenate([np.diff(dissipated(part)) for part in (closed, after)])
    created = float(np.maximum(-given, 0.0).sum()) + max(part.moments[-1].energy.closing for part in (closed, after))
    return {
        "error": shape_error(*closed.states[-1], plan_r_path(length)),
        "edge": float(end[0]) - length / 2.0,
        "dissipated": float(dissipated(after)[-1]),
        "created": max(created, 0.0),
    }


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
            abs(float(x) - errors["circular"]) for x in (at.finer_error.sel(path="circular"), *d.speed_error)
        ),
        "speeds": ", ".join(
            f"{float(x):.2f} at {float(v):g}" for x, v in zip(d.speed_error, d.gripper_speed, strict=True)
        ),
        "edge": at.edge.sel(path="circular"),
        "without": d.error.sel(mu=0.0).max(),
        "r_path_most": d.error.sel(path="r-path").max(),
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
            "between the layers took up to {dissipated:.2g}"),
    ),
}
# fmt: on


LOOKS = {name: look for name, (_, look) in PATH_LOOKS.items()} | {"low": Look(GREEN, "s")}
STYLES = PATH_STYLES | {"low": "-."}


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) the error of the finished fold in L* over mu, gripper closed, and (b) the folds at one mu.

    Open circles: elements and time steps half as long.  ``data`` is from :func:`verification.layer_friction.run`.
    """
    fig = figure(4.4)
    top, bottom = fig.subplots(2, 1, height_ratios=(2.4, 1.0))
    mu, shown = data["mu"].values, data.attrs["shown"]
    low, high = data.attrs["band"]
    top.axvspan(low, high, color=SHADE, lw=0.0, zorder=0, label="_fabrics")
    for name in data["path"].values:
        one, look = data.sel(path=name), LOOKS[name]
        style = {"color": look.color, "ls": STYLES[name]}
        top.plot(mu, one["error"].values, marker=look.marker, lw=1.1, **style, label=f"_{name}")
        top.plot(shown, one["finer_error"], "o", color=look.color, mfc="none", ms=8.0, label=f"_{name}-finer")
        width = 2.2 if name == "r-path" else 1.2
        bottom.plot(one["x"].values, one["z"].values, lw=width, **style, label=f"_{name}-fold")
    top.set(yscale="log", xlabel=r"coefficient of friction $\mu$", ylabel="error of the fold$\\,/\\,L^*$")
    bottom.axhline(0.0, color=GREY, lw=0.6, zorder=0)
    bottom.set(aspect="equal", xlabel="$x\\,/\\,L^*$", ylabel="$z\\,/\\,L^*$")
    bottom.set_ylim(-0.2, 1.6 * float(np.max(data["z"].values)))
    low = entry("low path", LOOKS["low"].color, STYLES["low"], marker=LOOKS["low"].marker, lw=0.9)
    legend_above(fig, [*path_entries(), low, entry("fabric on fabric", SHADE, lw=6.0)])
    note(top, "(a)")
    note(bottom, rf"(b) $\mu$ = {shown:g}", "upper right")
    return fig
