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
from stripfold.follow.track import mid_surfaces, nodes, shape_error
from stripfold.paths.geometric import circular, low, triangular
from stripfold.paths.rpath import plan_r_path
from stripfold.solve.schemes import Damping
from verification.common import Progress, dataset, pooled
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
LENGTH, THICKNESS = 14.0, 0.05
MOMENT, FABRIC = 0.02, 0.3
"""M_0 of the bending hysteresis, with which the R-path is followed, and that of fabrics, rho_a g L*^2."""
BAND = 0.2, 0.6
"""Coefficients of friction of fabrics on each other."""
OFF = 0.1
"""Error of a fold above which it is not accurate, L*."""


def run(
    coefficients: Sequence[float] = (0.0, 0.4),
    shown: float = 0.4,
    long: float = 24.0,
    speeds: Sequence[float] = (),
    finer: Sequence[str] = ("circular",),
    varied: Sequence[str] = PATHS,
    refinement: float = 1.0,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Errors of the fold over ``path`` and ``mu``, ``shown`` among these; there also over ``variant``, and the shapes.

    ``long``: another length.  ``speeds``: others of the gripper, on the circular path, sqrt(g L*).  ``finer``: paths
    that are computed with elements and time steps half as long, too.  ``varied``: those of the other length and of the
    friction of fabrics.  ``refinement``: factor on element lengths.
    """
    variants: dict[str, tuple[Sequence[str], dict[str, Any]]] = {
        "usual": (PATHS, {}),
        "finer": (finer, {"finer": True}),
        "long": (varied, {"length": long}),
        "without": (("r-path",), {"length": long, "moment": 0.0}),
        "fabric": (varied, {"moment": FABRIC}),
        **{f"{speed:g}": (("circular",), {"speed": speed}) for speed in speeds},
    }
    asked: dict[tuple[Any, str], Callable[[], dict[str, Any]]] = {
        (variant, path): partial(_numbers, refinement, path, shown, **how)
        for variant, (paths, how) in variants.items()
        for path in paths
    }
    asked |= {
        (mu, path): partial(_numbers, refinement, path, mu) for mu in coefficients if mu != shown for path in PATHS
    }
    found = dict(zip(asked, pooled(operator.call, asked.values(), threads, progress), strict=True))
    errors = [[found[v, path]["error"] if (v, path) in found else np.nan for path in PATHS] for v in variants]
    shapes = np.array([found["usual", path]["shape"] for path in PATHS])
    keys = ["usual" if mu == shown else mu for mu in coefficients]
    return dataset(
        {
            **{name: (("path", "mu"), [[found[key, path][name] for key in keys] for path in PATHS]) for name in VALUES},
            "path": ("path", PATHS),
            "mu": ("mu", coefficients),
            "variant": ("variant", list(variants)),
            "variant_error": (("variant", "path"), errors),
            "x": (("path", "node"), shapes[..., 0]),
            "z": (("path", "node"), shapes[..., 1]),
        },
        {"shown": shown, "long": long},
    )


def _numbers(
    refinement: float,
    name: str,
    mu: float,
    length: float = LENGTH,
    moment: float = MOMENT,
    speed: float = SPEED,
    finer: bool = False,
) -> dict[str, Any]:
    """Error and shape of the closed fold; place of its end after the gripper has opened, over the edge; energies."""
    fold = plan_r_path(length)
    path = fold.path if name == "r-path" else low(length, LOW) if name == "low" else GEOMETRIC[name](length)
    options = replace(TIME_OPTIONS, tolerance=HALF_STEP * TIME_OPTIONS.tolerance) if finer else TIME_OPTIONS
    how: dict[str, Any] = {"damping": DAMPING, "speed": speed, "options": options}
    how["refinement"] = refinement * (0.5 if finer else 1.0)
    closed = follow_in_time(StripModel(length, THICKNESS, kind="rod"), path, mu, moment, **how)
    after = opened(closed, DAMPING, options)
    end = mid_surfaces(after.states[-1:], np.zeros(1))[0][0]
    # What appears from nowhere: where friction gives some, and where the balance does not close.
    given: Array = np.concatenate([np.diff(dissipated(part)) for part in (closed, after)])
    created = float(np.maximum(-given, 0.0).sum()) + max(part.moments[-1].energy.closing for part in (closed, after))
    return {
        "error": shape_error(*closed.states[-1], fold),
        "shape": mid_surfaces(closed.states[-1:], nodes(length))[0],
        "edge": float(end[0]) - length / 2.0,
        "dissipated": float(dissipated(after)[-1]),
        "created": max(created, 0.0),
    }


def facts(d: xr.Dataset) -> Facts:
    """Errors of the folds at the coefficient shown, and from which coefficient on a path does not fold accurately."""
    at, of, wrong = d.sel(mu=d.attrs["shown"]), d.variant_error, d.error.sel(path="circular") > OFF
    first = int(wrong.values.argmax())
    circular = float(at.error.sel(path="circular"))
    speeds = [name for name in d.variant.values if name[0].isdigit()]
    # Of mesh and gripper: what varies in the user's world belongs to the error.
    varies = np.abs(of.sel(variant=["finer", *speeds], path="circular") - circular)
    return {
        **{f"usual_{path}": error for path, error in zip(d.path.values, at.error.values, strict=True)},
        **{f"{v}_{path}": of.sel(variant=v, path=path) for v in ("long", "fabric") for path in d.path.values},
        "without_r-path": of.sel(variant="without", path="r-path"),
        "mu": d.attrs["shown"],
        "length": LENGTH,
        "long": d.attrs["long"],
        "moment": MOMENT,
        "fabric": FABRIC,
        "finer": varies[0],
        "varies": varies.max(),
        "speeds": ", ".join(f"{float(of.sel(variant=v, path='circular')):.2f} at {v}" for v in speeds),
        "edge": at.edge.sel(path="circular"),
        "without": d.error.sel(mu=0.0).max(),
        "r_path_most": d.error.sel(path="r-path").max(),
        "from_": d.mu[max(first - 1, 0)],
        "to": d.mu[first],
        "in_band": wrong.sel(mu=slice(*BAND)).all(),
        "created": d.created.max(),
        "runs": d.created.size,
        "dissipated": d.dissipated.max(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("fold_error_mu", "usual_circular", "L*",
            "> 0.1 L* on the circular path at all coefficients of fabrics; < 0.05 L* on the R-path at all, and on all "
            "paths without friction",
            "distance of the finished fold of the circular path from the accurate one with a coefficient of friction "
            "of {mu:g} between the layers, gripper closed, length {length:g} L*, M_0 = {moment:g} rho_a g L*^2 "
            "({usual_r-path:.3f} on the R-path, {usual_triangular:.3f} on the triangular one; {without:.3f} at most "
            "without friction), the gripper at 0.2 sqrt(g L*); at other speeds {speeds}, with half the elements and "
            "steps {finer:.3f} off. It is off from a coefficient between {from_:g} and {to:g} on, fabrics have 0.2 to "
            "0.6; after the gripper has opened its end is {edge:.2f} L* past the edge. Length {long:g} "
            "L*: {long_circular:.2f}, R-path {long_r-path:.3f} ({without_r-path:.2f} without internal friction), "
            "triangular {long_triangular:.3f}",
            lambda f: f.in_band and max(f.r_path_most, f.without) < 0.05, "varies"),
        Number("fold_error_fabric", "fabric_circular", "L*", "> 1 L*, on the R-path < 0.1 L*",
            "the same with M_0 = {fabric:g} rho_a g L*^2, as fabrics have ({fabric_r-path:.3f} on the R-path, "
            "{fabric_triangular:.3f} on the triangular one)", lambda f: vars(f)["fabric_r-path"] < 0.1),
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
    top.axvspan(*BAND, color=SHADE, lw=0.0, zorder=0, label="_fabrics")
    for name in data["path"].values:
        one, look = data.sel(path=name), LOOKS[name]
        style = {"color": look.color, "ls": STYLES[name]}
        top.plot(mu, one["error"].values, marker=look.marker, lw=1.1, **style, label=f"_{name}")
        top.plot(
            shown,
            one["variant_error"].sel(variant="finer"),
            "o",
            color=look.color,
            mfc="none",
            ms=8.0,
            label=f"_{name}-finer",
        )
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
