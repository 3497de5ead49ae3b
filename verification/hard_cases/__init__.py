"""The hard cases: what a solver gets wrong first.

Each has one expected outcome: a value that is compared with an independent one, or a typed error.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.ask.inputs import Scene
from stripfold.base.errors import ContinuationError, CrushedError, InvalidInputError, NewtonError, SolveError
from stripfold.follow.statics import StripModel, solve_height
from stripfold.strip.rod import Rod
from stripfold.strip.solid import Solid
from verification.common import Progress, markdown_table, pooled, table
from verification.hard_cases import algebra, arch, strips
from verification.hard_cases.case import Case, judge
from verification.hard_cases.strips import HEIGHT, LENGTH, PAPERS
from verification.numbers import Facts, Number

UNITS = {"s": "seconds"}

BESIDE = 0.04
"""How far from the height at which the sag just touches, L*."""


def _end(thickness: float, height: float = HEIGHT, length: float = LENGTH, factor: float = 0.5) -> Callable:
    return lambda r: strips.end(StripModel(length, thickness), height, factor * r)


def _touch_limit(side: float) -> Callable:
    return lambda r: strips.end(StripModel(LENGTH, 0.02), elastica.touch_limit() + side * BESIDE, 0.5 * r)


def _from(height: float, change: Callable | None = None) -> Callable:
    return lambda r: strips.from_a_guess(height, r, change)


def _scene(length: float, height: float) -> None:
    Scene(length=length, height=height, eta_b=3780.0).require_long_enough()


LAMBDA_C, TOUCH = "lambda_c, rod", "lambda at the touch, rod"
BAD, NEAR = "no state of this strip: an error", "lambda_0, followed from the flat strip"
# A table: theme, name, what is compared, how, and the error where one is expected.
# fmt: off
CASES = tuple(Case(*row) for row in (
    ("very thin", "thin, h / L = 1e-5", "lambda_c, elastica", lambda r: strips.thin(0.5 * r)),
    ("very thin", "thin rod, h / L = 1e-5", "lambda_c, elastica",
     lambda r: strips.rod(9e-5, elastica.critical(HEIGHT).advance)),
    ("very thin", "z = 42.6 L*, h = 4e-4 L*, fine elements", "lambda_c, elastica", strips.high),
    ("very thin", "h = 1.5e-3 L*, pushed from the start of a path", "lambda at the snap, rod", strips.pushed),
    ("thick", "thick, h = 0.2 L*", "lambda_c, two elements across", lambda r: strips.thick(0.2, HEIGHT, 0.5 * r)),
    ("thick", "thick rod, h = 0.2 L*", "lambda_c, solid", lambda r: strips.thick_rod(0.5 * r)),
    ("thick", "too thick, h = 0.21 L*", BAD, lambda r: strips.scene(3780.0, "solid", 0.21), InvalidInputError),
    ("eta_b over eight decades", "eta_b 1e-1 to 1e8, rod", "relative spread of lambda_c / L*",
     lambda r: strips.decades()),
    ("eta_b over eight decades", "eta_b = 1e-1, solid", LAMBDA_C, lambda r: strips.one_decade(1e-1)),
    ("eta_b over eight decades", "eta_b = 1e8, solid", LAMBDA_C, lambda r: strips.one_decade(1e8)),
    ("eta_b over eight decades", "eta_b = 1e-1, usual eta_m", BAD, lambda r: strips.usual_eta_m(), InvalidInputError),
    ("long strips", "long, low", "lambda_c at L = 60, z = 3 L*, rod", _end(PAPERS, length=60.0)),
    ("long strips", "long, high", "lambda_c at L = 60, z = 10 L*, rod", _end(PAPERS, 10.0, 60.0)),
    ("taut strip", "pulled back", "horizontal force, elastica", strips.taut),
    ("coarse and very fine meshes", "very coarse mesh", LAMBDA_C, _end(PAPERS, factor=4.0)),
    ("coarse and very fine meshes", "very fine mesh", LAMBDA_C, _end(PAPERS, factor=0.25)),
    ("distorted meshes", "leaning elements", "droop of a cantilever, elastica", lambda r: algebra.droop(0.25)),
    ("near-inverted elements", "elements all but turned over", "droop of a cantilever, elastica",
     lambda r: algebra.droop(0.475)),
    ("near-inverted elements", "elements turned over", "no mesh: an error",
     lambda r: algebra.turned_over(), InvalidInputError),
    ("near-inverted elements", "strip turned inside out", BAD,
     lambda r: algebra.pressed(Solid.of(2.0, 0.1, elements=8), -0.2), CrushedError),
    ("near-inverted elements", "rod pressed to a fifth", BAD,
     lambda r: algebra.pressed(Rod.of(2.0, 0.1, elements=8), 0.2), CrushedError),
    ("very large and very small steps", "steps of 10 L*", "lambda_c, same mesh", lambda r: strips.with_steps(10.0, r)),
    ("very large and very small steps", "steps of 0.05 L*", "lambda_c, same mesh",
     lambda r: strips.with_steps(0.05, r)),
    ("starts from bad guesses", "from a flat strip", NEAR, _from(HEIGHT, strips.flat)),
    ("starts from bad guesses", "from half the height", NEAR, _from(0.5 * HEIGHT)),
    ("starts from bad guesses", "from twice the height", NEAR, _from(2.0 * HEIGHT)),
    ("starts from bad guesses", "from a noisy state", BAD, _from(HEIGHT, strips.noise(0.05)), NewtonError),
    ("starts from bad guesses", "from a state of noise", BAD, _from(HEIGHT, strips.noise(1.0)), NewtonError),
    ("starts from bad guesses", "from below the floor", BAD, _from(HEIGHT, strips.below_the_floor), NewtonError),
    ("starts from bad guesses", "a tenth of an L* past lambda_c", "no state is near: an error",
     strips.past_the_end, NewtonError),
    ("cusp", "arch below the cusp", "w / h at lambda = h, closed form; no fold may be found",
     lambda r: arch.through_the_cusp(0.9)),
    # As near as the closed form tells on which side of the cusp it is.
    ("cusp", "arch at the cusp", "the same where two folds have just met",
     lambda r: arch.through_the_cusp(1.0 - arch.REMAINDER)),
    ("cusp", "arch beyond the cusp", "lambda_c / h, closed form",
     lambda r: arch.first_critical(1.1, arch.fold_load(1.1))),
    ("cusp", "folds that meet", "exponent of lambda_c towards the cusp", lambda r: arch.folds_meet()),
    ("exact symmetry", "arch from both sides", "ratio of both folds", lambda r: arch.both_sides()),
    ("exact symmetry", "sway of a symmetric arch", "lambda_c / h, closed form: a bifurcation before the fold",
     lambda r: arch.first_critical(8.0, arch.sway_load(8.0))),
    ("exact symmetry", "column under its weight", "buckling length of the elastica, L*", lambda r: arch.column()),
    ("neighbourhood of a critical point", "just before a fold", "ratio of eigenvalues, closed form",
     lambda r: arch.root_law()),
    ("neighbourhood of a critical point", "just beyond a fold", "no state is near: an error",
     lambda r: arch.beyond_the_fold(), NewtonError),
    ("nearly singular K", "bordered, K singular to rounding", "error of the solution, which is given",
     lambda r: algebra.bordered()),
    ("nearly singular K", "strip held nowhere", "no equilibrium: an error",
     lambda r: algebra.held_nowhere(), NewtonError),
    ("nearly singular K", "K that needs a pivot", "its eigenvalues cannot be counted: an error",
     lambda r: algebra.needs_a_pivot(), SolveError),
    ("repeated eigenvalues", "double eigenvalue", "the second of two equal ones, closed form",
     lambda r: algebra.double_eigenvalue()),
    ("repeated eigenvalues", "fold and sway at once", "lambda_c / h, closed form",
     lambda r: arch.first_critical(5.5, arch.fold_load(5.5))),
    ("grazing contact", "just above the touch limit", "lambda_c, rod: a snap", _touch_limit(1.0)),
    ("grazing contact", "just below the touch limit", "lambda, rod: a touch", _touch_limit(-1.0)),
    ("gripper at the floor", "z = 0.5 L*", TOUCH, _end(0.02, 0.5)),
    ("gripper at the floor", "z = 0.3 L*", TOUCH, _end(0.02, 0.3)),
    ("gripper at the floor", "z = 0.1 L*", TOUCH, _end(0.02, 0.1)),
    ("gripper at the floor", "z = 0.1 L*, h = 0.06 L*", BAD,
     lambda r: solve_height(StripModel(LENGTH, PAPERS), 0.1, 0.5 * r), ContinuationError),
    ("gripper at the floor", "touch in the last step of a path", "lambda at the touch, rod", strips.touched_last),
    ("gripper at the floor", "landing beside a layer that lies", "height of the fold, elastica", strips.landed),
    ("gripper at the floor", "z = 0", "no folding: an error", lambda r: _scene(0.6, 0.0), InvalidInputError),
    ("lift-off of the whole strip", "strip of 6.5 L*", "lambda, elastica of the same free length",
     strips.lifted_whole),
    ("lift-off of the whole strip", "strip of 6.5 L*, asked for", "too short: an error",
     lambda r: _scene(0.18, 0.09), InvalidInputError),
))
# fmt: on


def run(refinement: float = 1.0, every: int = 1, threads: int = 1, progress: Progress | None = None) -> xr.Dataset:
    """Over ``case``; ``refinement`` is a factor on all element lengths; one case in ``every`` is run."""
    rows = pooled(partial(_numbered, refinement), range(0, len(CASES), every), threads, progress)
    return table("case", rows, {"refinement": refinement}, units=UNITS)


def _numbered(refinement: float, number: int) -> dict[str, Any]:
    return judge(CASES[number], refinement)


def markdown(data: xr.Dataset) -> str:
    """The cases as a table."""
    rows = []
    for i in range(data.sizes["case"]):
        row = {name: variable.values[i] for name, variable in data.variables.items()}
        valued = row["outcome"] == "value"
        what = f"{row['value']:.6g}" if valued else f"`{row['outcome']}`"
        off, allowed = (f"{row['error']:.1e}", f"{row['allowed']:.1e}") if valued else ("", "")
        cells = (row["theme"], row["name"], row["judged"], what, off, allowed, f"{row['seconds']:.1f}")
        rows.append((*cells, "no" if row["failed"] else "yes"))
    return markdown_table(("theme", "case", "judged", "outcome", "off by", "allowed", "s", "holds"), rows)


def facts(d: xr.Dataset) -> Facts:
    # So written, nan counts as failed.
    failed = ~(d.failed.values == 0.0)
    names = ", ".join(d["name"].values[failed])
    errors = np.sum(d.outcome.values != "value")
    cases = d.sizes["case"]
    return {
        "cases": cases,
        "errors": errors,
        "values": cases - errors,
        "failed": failed.sum(),
        "names": names or "none",
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("hard_cases_failed", "failed", "count", "= 0",
            "hard cases, of {cases}, that do not end in the one outcome expected of them: {names}"),
    ),
}
# fmt: on
