"""Tables of the page docs/physics.md, from the studies that have their numbers; lengths in L*."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

from stripfold.base.arrays import Array
from verification import variants
from verification.common import markdown_table


def _over(data: xr.Dataset, along: str, name: str, rows: dict[str, tuple[Array, str]]) -> str:
    """Rows of numbers, each with its format, over a coordinate in ascending order."""
    order = np.argsort(data[along].values)
    shown = [[f"{float(x):g}" for x in data[along].values[order]]]
    shown += [[format(float(x), form) if np.isfinite(x) else "-" for x in v[order]] for v, form in rows.values()]
    (header, *cells), words = shown, list(rows)
    found = markdown_table([name, *header], ([word, *row] for word, row in zip(words, cells, strict=True)))
    return found.replace("L*", r"L\*")


def barrier(data: xr.Dataset) -> str:
    """Of each height: the law's coefficient, the bistable range, and the largest barrier."""
    rows: dict[str, tuple[Array, str]] = {
        "C": (data["coefficient"].values, ".4f"),
        "lambda_c - lambda_t / L*": (data["width"].values, ".2g"),
        "largest barrier / rho_a g L*^2": (data["largest"].values, ".2g"),
        "its rms speed / sqrt(g L*)": (data["speed"].values, ".2g"),
    }
    return _over(data, "gripper_height", "z / L*", rows)


def delay(data: xr.Dataset) -> str:
    """Of each height: the rise over a small M_0, and the M_0 that ends it."""
    rows: dict[str, tuple[Array, str]] = {
        "C / L*": (data["coefficient"].values, ".2f"),
        "largest M_0 with a snap": (data["vanishes_above"].values, ".2g"),
        "least M_0 without one": (data["vanishes_below"].values, ".2g"),
    }
    return _over(data, "gripper_height", "z / L*", rows)


def folds(data: xr.Dataset) -> str:
    """Errors of the finished folds over the friction between the layers, by path."""
    rows = {str(path): (data["error"].sel(path=path).values, ".2f") for path in data.path.values}
    return _over(data, "mu", "coefficient", rows)


def first_touch(data: xr.Dataset) -> str:
    """First touch less the planned one over M_0, by path and length."""
    rows = {}
    for path in data.path.values:
        for length in data.length.values:
            one = (data["touch_x"] - data["planned_x"]).sel(path=path, length=length)
            rows[f"{path}, {length:g} L*"] = (one.values, "+.2f")
    return _over(data, "moment", "M_0 / (rho_a g L*^2)", rows)


def textile(data: xr.Dataset) -> str:
    """lambda_c of the textile with its secant and with its measured law, over the height."""
    secant, measured = (data["advance"].sel(law=law).values for law in ("secant", "measured"))
    rows: dict[str, tuple[Array, str]] = {
        "lambda_c / L*, secant": (secant, ".2f"),
        "lambda_c / L*, measured law": (measured, ".2f"),
        "rise": (measured / secant - 1.0, ".0%"),
        "largest curvature L*": (data["curvature"].sel(law="measured").values, ".1f"),
    }
    return _over(data, "gripper_height", "z / L*", rows)


def fabric_paths(data: xr.Dataset) -> str:
    """Of each fabric, along warp and weft: where its strip is lost on a path, as a share, and M_0 that suffices."""

    def shown(value: float) -> str:
        return "-" if np.isnan(value) else "followed" if value == 1.0 else f"{value:.2f}"

    def friction(value: float) -> str:
        return "-" if np.isnan(value) else "> 0.8" if np.isinf(value) else f"{value:g}"

    rows = []
    for name in data.fabric.values:
        for direction in data.direction.values:
            one = data.sel(fabric=name, direction=direction)
            lost = [shown(float(one[path])) for path in ("low", "triangular", "followed")]
            rows.append([f"{name}, {direction}", *lost, friction(float(one.friction))])
    return markdown_table(["fabric", "low path", "triangular", "R-path", r"M_0 / (rho_a g L\*^2)"], rows)


def fabrics(data: xr.Dataset) -> str:
    """Those whose friction is known, the least first."""
    known = data.sel(fabric=data.bent.values).drop_vars("bent").assign(friction=("fabric", data.friction.values))
    known = known.sortby("friction")
    rows = zip(known.fabric.values, known.gravity_length.values, known.friction.values, strict=True)
    cells = ([str(name), f"{100.0 * length:.2f} cm", f"{moment:.2f}"] for name, length, moment in rows)
    return markdown_table(["fabric", r"L\*", r"M_0 / (rho_a g L\*^2)"], cells)


TABLES: dict[str, tuple[str, Callable[[xr.Dataset], str]]] = {
    "energy barrier": ("barrier", barrier),
    "delay by friction": ("friction_delay", delay),
    "folds with friction between the layers": ("layer_friction", folds),
    "first touch with friction": ("friction_touch", first_touch),
    "friction of fabrics": ("fabrics", fabrics),
    "law of the textile": ("fabric_laws", textile),
    "paths of fabrics": ("fabric_laws", fabric_paths),
    "variants": ("variants", variants.markdown),
}
"""The study and the function of each table."""
