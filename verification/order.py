"""Observed order of lambda_c in the element length, and its run time over the number of elements, on rod and solid.

A mesh is refined uniformly: each of its elements is divided into equal parts.  lambda_c is solved for directly, to many
more digits than the tolerance of the bracket that checks it.  All in L*.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from plots.pieces import MODEL_LOOKS, note, plain_numbers
from stripfold import elastica
from stripfold.ask.prediction import BEFORE, ElasticaPrediction
from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.draw.colours import GREY
from stripfold.draw.style import figure, styled
from stripfold.follow.contact_branch import STEPS, from_elastica
from stripfold.follow.statics import LAMBDA_TOLERANCE, StripModel
from stripfold.solve import continuation, critical
from stripfold.solve.continuation import Crossing
from stripfold.solve.critical import LIMIT
from stripfold.strip.contact_mesh import ContactMesh
from stripfold.strip.problem import AlongX
from verification.common import Progress, attempted, dataset, grid, timed
from verification.numbers import Facts, Number

UNITS = {"s": "seconds"}

MODELS = ("rod", "solid")


def divided(mesh: ContactMesh, parts: int) -> ContactMesh:
    """A mesh with each element divided into ``parts`` of one length."""
    shares = tuple(np.repeat(share / parts, parts) for share in mesh.shares)
    ends = np.append(0.0, np.cumsum(np.repeat(mesh.model.lengths / parts, parts)))
    return replace(mesh, shares=shares, model=mesh.make(ends))


def lambda_c(strip: StripModel, prediction: ElasticaPrediction, refinement: float, parts: int) -> tuple[float, Array]:
    """lambda_c on one mesh, and the ends of its elements there.

    Raises SolveError: the branch cannot be followed, or has no limit point near the elastica's.
    """
    z, plan = prediction.height, strip.contact_mesh(refinement)
    near = elastica.state_at(z, prediction.last.length - BEFORE, prediction.last)
    first = from_elastica(lambda contact: divided(plan(contact), parts), AlongX(z), near.advance, near)
    problem = first.problem
    for item in continuation.follow(problem, first.point, STEPS, [LIMIT]):
        if isinstance(item, Crossing):
            found = critical.locate(problem, item.before, item.after, LAMBDA_TOLERANCE, STEPS)
            return found.lam, problem.at(problem.contact(found.before.q)).model.ends
        if problem.mesh.drifted(problem.contact(item.q)):
            break
    raise SolveError(f"no snap at z = {z:g} L*, each element divided into {parts}")


def run(
    length_star: float = 16.0,
    thickness: float = 0.0594,
    height: float = 3.0,
    refinement: float = 2.0,
    parts: Sequence[int] = (1, 2, 4, 8, 16, 32, 64, 128, 328),
    reference: int = 16,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Errors and times of both models.

    ``length_star``, ``thickness``, ``height``: L*.  ``refinement``: of the planned mesh.  ``parts``: numbers of parts
    of each of its elements, ascending.  ``reference``: one of these: the error of coarser meshes is the distance of
    lambda_c from that with it.
    """
    prediction = ElasticaPrediction.at(height)

    def case(model: str, number: int) -> dict[str, float]:
        strip = StripModel(length_star, thickness, kind=model)
        (seconds,), (lam, ends) = timed(partial(lambda_c, strip, prediction, refinement, number), 1, first=False)
        return {"lambda_c": lam, "size": ends[1], "elements": len(ends) - 1.0, "seconds": seconds}

    for model in MODELS:
        # Uncounted: compiles the model's kernels.
        attempted(partial(case, model, parts[0]))
    names = ("lambda_c", "size", "elements", "seconds")
    values = grid(case, names, {"model": MODELS, "parts": parts}, progress=progress)
    found, size, elements, seconds = (values[name][1] for name in names)
    finest = list(parts).index(reference)
    error = np.abs(found - found[:, finest, None])
    error[:, finest:] = np.nan
    large = np.asarray(parts) >= reference

    def slopes(x: Array, y: Array) -> list[float]:
        return [float(np.polyfit(np.log(a), np.log(b), 1)[0]) for a, b in zip(x, y, strict=True)]

    return dataset(
        {
            **values,
            "error": (("model", "parts"), error),
            # Of the two finest: on coarse meshes of the solid two errors cancel.
            "order": ("model", slopes(size[:, finest - 2 : finest], error[:, finest - 2 : finest])),
            "cost_order": ("model", slopes(elements[:, large], seconds[:, large])),
        },
        {"length_star": length_star, "thickness": thickness, "height_star": height, "refinement": refinement},
        units=UNITS,
    )


def facts(d: xr.Dataset) -> Facts:
    return {
        "rod": d.order.sel(model="rod"),
        "solid": d.order.sel(model="solid"),
        "coarsest": int(d.elements.isel(parts=0).min()),
        "elements": int(d.elements.isel(parts=-1).min()),
        "cost": d.cost_order.max(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("order_lambda_c", "rod", "1", "> 3.7 on the rod, at least 3 on the solid",
            "observed order of lambda_c in the element length on the rod, between the two finest of the meshes refined "
            "uniformly from {coarsest} elements; on the solid {solid:.2f}", lambda f: f.rod > 3.7 and f.solid >= 3.0),
        Number("order_cost", "cost", "1", "< 1.2",
            "order of the run time of one lambda_c in the number of elements, the larger of both models, up to "
            "{elements} elements"),
    ),
}
# fmt: on


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) the error over the element length, beside plain powers, (b) the time over the number of elements."""
    fig = figure(4.8)
    top, bottom = fig.subplots(2, 1)
    for name in data["model"].values:
        one = data.sel(model=name)
        # Of the meshes up to the reference of the stored errors; that reference has an error of its own.
        count = 1 + int(one["error"].notnull().sum())
        size, lambda_c = one["size"].values[:count], one["lambda_c"].values
        error = np.abs(lambda_c[:count] - lambda_c[min(count + 1, len(lambda_c) - 1)])
        power = float(one["order"])
        top.plot(size, error, **MODEL_LOOKS[name]._asdict(), label=name)
        line = error[-1] * (size / size[-1]) ** round(power)
        top.plot(size, line, color=MODEL_LOOKS[name].color, ls=":", lw=0.8, label=f"power {power:.0f}")
        bottom.plot(one["elements"], one["seconds"], **MODEL_LOOKS[name]._asdict(), label=name)
    elements, seconds = (data[name].isel(model=-1).values for name in ("elements", "seconds"))
    bottom.plot(elements, seconds[-1] * elements / elements[-1], color=GREY, ls="--", lw=0.8, label="linear")
    top.set(xlabel="element length off the floor $/\\,L^*$", ylabel=r"error of $\lambda_c\,/\,L^*$")
    bottom.set(xlabel="elements", ylabel=r"run time of one $\lambda_c$ [s]")
    note(top, f"(a) $z = {data.attrs['height_star']:g}\\,L^*$, $h = {data.attrs['thickness']:g}\\,L^*$")
    note(bottom, "(b)")
    for ax in (top, bottom):
        ax.set(xscale="log", yscale="log")
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.legend(loc="lower right", fontsize=7)
    plain_numbers(top.xaxis)
    fig.align_ylabels()
    return fig
