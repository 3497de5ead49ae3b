"""What each choice of the model changes: the end of the advance along x, and the first touch on the triangular path.

Poisson's ratio, the stretch, the width, the gripper's hinge and the pin that holds the strip, each changed alone.  A
pin that gives moves with the horizontal force: along x
its lambda_c is that of the elastica, whose branch is the same in the frame of the pin; on a path the gripper goes in
that frame along the path less the pin's displacement, taken from the force on the path of the fixed pin.
Lengths in L*, forces in rho_a g L*.  Source: docs/physics.md, section 12.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import nan, radians, sqrt
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.optimize import brentq, minimize_scalar

from stripfold import elastica
from stripfold.ask.prediction import ElasticaPrediction, end_of_advance
from stripfold.base.errors import SolveError
from stripfold.follow.contact_branch import Planned
from stripfold.follow.fall import Fall, ReleaseState, simulate_fall
from stripfold.follow.statics import StripModel, follow
from stripfold.follow.track import End
from stripfold.paths.curve import GripperPath
from stripfold.paths.geometric import triangular
from verification.common import NO_RESULT, Progress, attempted, markdown_table, pooled, table
from verification.numbers import Facts, Number

FALL = Fall(to_rest=False)
EARLIER = 1.6
"""Free length by which a state lies before the critical one of hinge and pin, and before those of the variants, L*."""


def run(
    height: float = 3.0,
    length_star: float = 20.0,
    thickness: float = 0.0594,
    refinement: float = 0.5,
    poisson: Sequence[float] = (0.3, 0.45),
    eta_m: Sequence[float] = (4.0, 0.25, 0.01),
    narrow: float = 0.3,
    angles: Sequence[float] = (0.0, 45.0, 90.0, 120.0),
    compliance: float = 0.1,
    sliding: float = 0.1,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """End of the advance and first touch over ``variant``, and their differences from those of the variant's ``base``.

    ``poisson``: Poisson's ratios; ``eta_m``: factors on the stretch at the same eta_b; ``narrow``: Poisson's ratio of a
    strip whose eta_b is that of plane strain, but which is as narrow as a beam; ``angles``: of the strip at a clamp,
    degrees; ``compliance``: of a pin that is a spring, L* per force; ``sliding``: force at which a pin slides.
    """
    strip = StripModel(length_star, thickness, kind="rod")
    rod = Scene(strip, height, refinement)
    solid = replace(rod, strip=replace(strip, kind="solid"))
    usual = (end_along_x, touch_on_path)
    ratio = (1.0 - narrow**2) ** (1.0 / 3.0)
    as_beam = replace(rod.changed(length=length_star / ratio, thickness=thickness / ratio), height=height / ratio)
    clamps = {angle: partial(clamped_along_x, angle=radians(angle)) for angle in angles}
    gives = partial(giving_along_x, compliance=compliance)
    cases = [
        Case(ELASTICA, "", rod, of_elastica, touch_on_path),
        Case(ROD, "", rod, *usual),
        Case(SOLID, "", solid, *usual),
        *(Case(f"Poisson's ratio {nu:g}", SOLID, solid.changed(nu=nu), *usual) for nu in poisson),
        *(Case(f"eta_m times {by:g}", ROD, rod.changed(thickness=thickness * sqrt(by)), *usual) for by in eta_m),
        Case(f"narrow strip, Poisson's ratio {narrow:g}: D is that of a beam", ROD, as_beam, *usual, ratio),
        *(Case(f"gripper clamps the strip at {angle:g} degrees", ROD, rod, clamps[angle]) for angle in angles),
        Case(f"pin gives by {compliance:g} L* under rho_a g L*", ELASTICA, rod, gives),
        Case(f"pin slides at {sliding:g} rho_a g L*", ELASTICA, rod, partial(sliding_along_x, force=sliding)),
    ]
    rows = dict(zip([case.name for case in cases], pooled(Case.found, cases, threads, progress), strict=True))
    coarse, _ = attempted(partial(touch_on_path, replace(rod, refinement=2.0 * refinement)))
    out = []
    for case in cases:
        row, base = rows[case.name], rows[case.base or case.name]
        shifts = {f"{name}_shift": row[name] - base[name] for name in ("lambda_end", "touch")}
        out.append({"variant": case.name, "base": case.base} | row | shifts)
    attrs = {"height": height, "length_star": length_star, "thickness": thickness, "refinement": refinement}
    attrs["touch_error"] = nan if coarse is None else abs(coarse - rows[ROD]["touch"])
    return table("variant", out, attrs)


ELASTICA, ROD, SOLID = "elastica", "rod", "solid"
"""The variants that others are compared with: hinge and pin, no Poisson's ratio."""


@dataclass(frozen=True)
class Scene:
    """A strip, the height of its gripper along x, and the factor on the elements."""

    strip: StripModel
    height: float
    refinement: float

    def changed(self, **values: float) -> Scene:
        """With another strip."""
        return replace(self, strip=replace(self.strip, **values))  # type: ignore[arg-type]

    @property
    def mesh(self) -> Planned:
        """Plans the elements."""
        return self.strip.contact_mesh(self.refinement)

    @property
    def path(self) -> GripperPath:
        """The triangular path."""
        return triangular(self.strip.length)


Advance = tuple[float, bool]
"""lambda at the end of the advance, and whether the strip snaps there; else the sag touches."""


class Case(NamedTuple):
    """A variant: what finds the end of its advance and its first touch, if anything; ``ratio`` is their unit."""

    name: str
    base: str
    scene: Scene
    along_x: Callable[[Scene], Advance] | None = None
    on_path: Callable[[Scene], float] | None = None
    ratio: float = 1.0

    def found(self) -> dict[str, Any]:
        """The row of this variant."""
        end, no_end = attempted(partial(self.along_x, self.scene)) if self.along_x else (None, "")
        touch, no_touch = attempted(partial(self.on_path, self.scene)) if self.on_path else (None, "")
        return {
            "lambda_end": nan if end is None else self.ratio * end[0],
            "snap": nan if end is None else float(end[1]),
            "touch": nan if touch is None else self.ratio * touch,
            NO_RESULT: no_end + no_touch,
        }


def markdown(data: xr.Dataset) -> str:
    """The table of the differences."""

    def shown(value: xr.DataArray) -> str:
        return f"{float(value):+.4f}" if np.isfinite(value) else "-"

    rows = []
    for name in data["variant"].values[data["base"].values != ""]:
        one = data.sel(variant=name)
        laid = ", no snap: the sag touches" if one["snap"] == 0.0 else ""
        rows.append((name, f"{shown(one['lambda_end_shift'])}{laid}", shown(one["touch_shift"])))
    return markdown_table(("changed", "end of the advance / L*", "first touch / L*"), rows).replace("L*", r"L\*")


def end_along_x(scene: Scene) -> Advance:
    """With hinge and pin."""
    run = end_of_advance(scene.strip, ElasticaPrediction.at(scene.height), scene.refinement)
    return run.lam, run.end is End.SNAP


def touch_on_path(scene: Scene) -> float:
    """x of the first touch on the triangular path, after a fall from the critical point, with hinge and pin."""
    segment = follow(scene.mesh, scene.path, scene.strip.length)
    if segment.critical is None:
        raise SolveError("no critical point on the path", parameter=scene.path.length)
    return simulate_fall(ReleaseState.at(segment.last, scene.refinement), FALL).touch_x


def clamped_along_x(scene: Scene, angle: float) -> Advance:
    """The end of the advance of a rod whose gripper clamps it at this angle, rad."""
    run = end_of_advance(scene.strip, ElasticaPrediction.at(scene.height), scene.refinement, angle=angle)
    return run.lam, run.end is End.SNAP


def of_elastica(scene: Scene) -> Advance:
    """With hinge and pin, infinitely thin."""
    found = elastica.critical(scene.height)
    return found.state.advance, found.snap


def giving_along_x(scene: Scene, compliance: float) -> Advance:
    """The critical point of the elastica with a pin that is a spring of this compliance.

    Under the tension F_x the pin moves by compliance * F_x towards the gripper, whose advance is less by as much.
    """
    height, last = scene.height, elastica.critical(scene.height).state

    def loss(length: float) -> float:
        state = elastica.state_at(height, length, last)
        return compliance * state.force_x - state.advance

    bounds = last.length - EARLIER, last.length
    found = minimize_scalar(loss, bounds=bounds, method="bounded", options={"xatol": 1e-7})
    return -float(found.fun), True


def sliding_along_x(scene: Scene, force: float) -> Advance:
    """The critical point of the elastica with a pin that slides under a tension, less than that of the critical state.

    From there on the force cannot rise with the advance, as it does in equilibrium: the strip snaps.
    """
    height, last = scene.height, elastica.critical(scene.height).state

    def over(length: float) -> float:
        return elastica.state_at(height, length, last).force_x - force

    length = brentq(over, last.length - EARLIER, last.length, xtol=1e-12)
    return elastica.state_at(height, length, last).advance, True


def facts(d: xr.Dataset) -> Facts:
    """Changes of the end of the advance by kind of variant."""
    names = d.variant.values.astype(str)
    shift = np.abs(d.lambda_end_shift.values)

    def of(*words: str) -> np.ndarray:
        return np.array([any(word in name for word in words) for name in names])

    def largest(*words: str) -> float:
        return float(np.nanmax(shift[of(*words)]))

    clamped = of("clamps") & np.isfinite(shift)
    return {
        "z": d.attrs["height"],
        "poisson": float(np.nanmax(shift[of("Poisson") & ~of("narrow")])),
        "stretch": largest("eta_m"),
        "narrow": largest("narrow"),
        "pin": largest("pin "),
        "clamp": largest("clamps"),
        "angles": clamped.sum(),
        "touching": (d.snap.values[clamped] == 0.0).sum(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("variant_poisson", "poisson", "L*", "< 0.005 L*",
            "largest change of lambda_c at z = {z:g} L* by Poisson's ratio at the same eta_b; by eta_m {stretch:.2g} "
            "L*, by the width up to {narrow:.2g} L*, by a pin that gives or slides up to {pin:.2g} L*"),
        Number("variant_clamp", "clamp", "L*", "no criterion",
            "largest change of the end of the advance by a clamp in place of the gripper's hinge; at {touching} of "
            "{angles} angles the sag touches before lambda has a maximum"),
    ),
}
# fmt: on
