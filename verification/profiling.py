"""Where the time of one lambda_c of the solid goes, of one of the elastica, and of one R-path assessed on the rod.

Functions are wrapped with timers while it is computed: each has its own time, without that of other wrapped ones, and
the time of a call with all in it.  The unit of a step of any kind is one assembly plus one factorisation: no solution
takes less.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from stripfold import elastica, paths
from stripfold.ask import critical, prediction
from stripfold.ask.assess import assess
from stripfold.ask.inputs import PathInputs, Scene
from stripfold.base.errors import StripfoldError
from stripfold.elastica import _events as events
from stripfold.elastica import _system as system
from stripfold.elastica import critical_point
from stripfold.elastica.state import State
from stripfold.follow import contact_branch
from stripfold.solve import continuation, dynamics, newton, schemes
from stripfold.solve import critical as solve_critical
from stripfold.solve.linear import Band
from stripfold.strip.contact_mesh import ContactMesh
from stripfold.strip.model import Model
from stripfold.strip.rod import Rod
from stripfold.strip.solid import Solid
from verification.common import dataset

UNITS = {"s": "seconds unit"}


class Part(NamedTuple):
    """A wrapped function: where its callers find it, and what it does."""

    owner: Any
    function: str
    what: str


PARTS = (
    Part(Model, "force_and_derivatives", "assembly"),
    Part(Model, "force_and_tangent", "assembly"),
    Part(Band, "factor", "factorisation"),
    Part(Model, "force_over_step", "assembly over a time step"),
    Part(Model, "predict_stress", "stress of the next tangent"),
    Part(Band, "with_fixed", "boundary conditions and contact"),
    Part(Band, "negatives", "count of negative eigenvalues"),
    Part(continuation, "nearest_eigenvalues", "eigenvalues"),
    Part(newton, "rounding", "rounding of the residual"),
    Part(newton, "solve_bordered", "bordered systems"),
    Part(newton, "solve", "Newton"),
    Part(continuation, "evaluate", "tangent and stability of a point"),
    Part(continuation, "step", "step of the continuation"),
    Part(solve_critical, "limit_point", "limit point"),
    Part(ContactMesh, "of", "planning of the mesh"),
    Part(Solid, "of", "mesh and model"),
    Part(Rod, "of", "mesh and model"),
    Part(elastica, "critical", "elastica's critical point"),
    Part(elastica, "state_at", "elastica's state near it"),
    Part(prediction, "without_horizontal_force", "state without horizontal force"),
    Part(contact_branch, "clearance", "clearance of the sag"),
    Part(schemes, "solve_compiled", "Newton of a time step"),
    Part(dynamics, "step", "time step"),
    Part(dynamics, "error_of", "error of a time step"),
)
OF_ELASTICA = (
    *(Part(module, "jacobian", "assembly") for module in (system, events)),
    *(Part(module, "solved", "factorisation") for module in (system, events)),
    Part(system, "residual", "residual"),
    *(Part(module, "evaluate", "angles of a state") for module in (system, events)),
    Part(system, "newton", "Newton"),
    Part(events, "slope", "condition of the limit point"),
    Part(State, "zeros", "place of the sag"),
    Part(critical_point, "start", "stored start"),
)
UNIT_PARTS = ("assembly", "factorisation")
"""The work that a step is compared with."""
REST = "the rest"


class Clock:
    """Own and whole times, and calls, of each part."""

    def __init__(self, parts: Sequence[Part] = PARTS, now: Callable[[], float] = perf_counter) -> None:
        self._now, self._open = now, [REST]
        self._since = now()
        names = list(dict.fromkeys([*(part.what for part in parts), REST]))
        self.own, self.whole = dict.fromkeys(names, 0.0), dict.fromkeys(names, 0.0)
        self.calls = dict.fromkeys(names, 0)

    def _switch(self) -> float:
        """Give the time since the last switch to what was running."""
        now = self._now()
        self.own[self._open[-1]] += now - self._since
        self._since = now
        return now

    def timed(self, what: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, timed as ``what``."""

        @wraps(function)
        def inner(*args: Any, **kwargs: Any) -> Any:
            began = self._switch()
            self._open.append(what)
            try:
                return function(*args, **kwargs)
            finally:
                ended = self._switch()
                self._open.pop()
                self.whole[what] += ended - began
                self.calls[what] += 1

        return inner

    def stop(self) -> None:
        """The time since the last part is that of the rest."""
        self._switch()
        self.whole[REST], self.calls[REST] = self.own[REST], 1


@contextmanager
def clock(parts: Sequence[Part]) -> Iterator[Clock]:
    """A clock for all parts while the block runs."""
    timer = Clock(parts)
    kept = [vars(part.owner)[part.function] for part in parts]
    try:
        for part, function in zip(parts, kept, strict=True):
            plain = getattr(function, "__func__", function)  # of a class method
            timed = timer.timed(part.what, plain)
            setattr(part.owner, part.function, classmethod(timed) if plain is not function else timed)  # type: ignore[arg-type]
        yield timer
        timer.stop()
    finally:
        for part, function in zip(parts, kept, strict=True):
            setattr(part.owner, part.function, function)


LAMBDA_C, ELASTICA, R_PATH = SUBJECTS = "lambda_c", "the elastica", "R-path on the rod"
"""Subjects of the profiles."""


def run(
    length: float = 0.6,
    height: float = 0.09,
    eta_b: float = 3780.0,
    accuracy: float = 0.001,
    path_length: float = 0.5,
    repeats: int = 2,
) -> xr.Dataset:
    """Profile one lambda_c of the solid, one of the elastica, and one R-path assessed on the rod; over ``subject``.

    ``length``, ``height``, ``eta_b``, ``accuracy``: the scene of the lambda_c, SI; see :class:`.Scene`.
    ``path_length``: of the strip on the R-path, of the same eta_b, m.  ``repeats``: see :func:`profile`.
    """
    scene = Scene(length=length, height=height, eta_b=eta_b, accuracy=accuracy)
    asked = PathInputs(length=path_length, eta_b=eta_b, model="rod", fall=True)
    path = paths.r_path(asked)
    profiles = [
        profile(lambda: critical.find(scene), repeats),
        profile(lambda: critical_point.critical(scene.height_star), repeats, OF_ELASTICA),
        profile(lambda: assess(asked, path), repeats),
    ]
    data = xr.concat(profiles, dim="subject", join="outer").assign_coords(
        dataset({"subject": ("subject", SUBJECTS)}, units=UNITS).coords
    )
    return data.assign_attrs(length=length, height=height, eta_b=eta_b, accuracy=accuracy, path_length=path_length)


def profile(call: Callable[[], object], repeats: int, parts: Sequence[Part] = PARTS) -> xr.Dataset:
    """Over ``part``: medians over ``repeats`` calls after an uncounted one."""
    call()
    clocks: list[Clock] = []
    for _ in range(repeats):
        with clock(parts) as timer:
            call()
        clocks.append(timer)
    if any(timer.calls != clocks[0].calls for timer in clocks):
        raise StripfoldError("calls of the same computation differ")
    names = list(clocks[0].own)
    own, whole = (
        np.median([[getattr(timer, of)[name] for name in names] for timer in clocks], axis=0) for of in ("own", "whole")
    )
    number = np.array([clocks[0].calls[name] for name in names])
    with np.errstate(invalid="ignore"):
        per_call = whole / number
    unit = sum(per_call[names.index(name)] for name in UNIT_PARTS)
    return dataset(
        {
            "part": ("part", names),
            "seconds": ("part", own),
            "share": ("part", own / own.sum()),
            "calls": ("part", number),
            "ratio": ("part", per_call / unit),
            "unit": ((), unit),
        },
        units=UNITS,
    )


def table(data: xr.Dataset) -> str:
    """One subject as a table in Markdown, the largest first; parts that were not called are left out."""
    called = data.sel(part=data["calls"] > 0).sortby("seconds", ascending=False)
    rows = ["| part | ms | share | calls | one call / (assembly + factorisation) |", "|---|---|---|---|---|"]
    for name in called["part"].values:
        one = called.sel(part=name)
        ratio = "" if name == REST else f"{float(one['ratio']):.2g}"
        rows.append(
            f"| {name} | {1e3 * float(one['seconds']):.3g} | {100 * float(one['share']):.0f} % | "
            f"{int(one['calls'])} | {ratio} |"
        )
    whole, unit = 1e3 * float(data["seconds"].sum()), 1e3 * float(data["unit"])
    rows.append(f"| all | {whole:.3g} | | | {whole / unit:.3g} (one assembly plus one factorisation: {unit:.2g} ms) |")
    return "\n".join(rows) + "\n"
