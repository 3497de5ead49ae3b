"""The paper's printed constitutive law on a strip that turns: stress and bending stiffness.

A strip that is folded turns by up to 180 degrees.  An objective law is not affected by the rotation; the printed one is
(``docs/physics.md``, section 2).
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from plots.pieces import note
from stripfold.base.arrays import Array
from stripfold.draw.colours import BLACK, VERMILLION
from stripfold.draw.style import figure, legend_above, styled, text_at
from stripfold.strip.reference import LAWS, product, second_piola, second_piola_rate
from verification.common import dataset
from verification.numbers import Facts, Number

STRETCH = 1.1
"""Stretch of the bar along its axis."""
_LAME = {"lam": 0.0, "mu": 0.5}
"""Lame parameters."""


def run(angles: Array | None = None) -> xr.Dataset:
    """Both laws over the angle of rotation, with Young's modulus 1 and Poisson's ratio 0.

    ``angles``: angles of rotation, degrees, shape (m,); by default 0, 1, ..., 90.

    Over ``angle``: ``stress_svk`` and ``stress_printed``, see :func:`stress`; ``stiffness_svk`` and
    ``stiffness_printed``, see :func:`stiffness`.  The attribute ``stretch`` is that of the bar.
    """
    angle = np.linspace(0.0, 90.0, 91) if angles is None else np.asarray(angles, dtype=float)
    values: dict[str, tuple[str, Array]] = {"angle": ("angle", angle)}
    for name in LAWS:
        values |= {
            f"stress_{name}": ("angle", stress(name, angle)),
            f"stiffness_{name}": ("angle", stiffness(name, angle)),
        }
    return dataset(values, {"stretch": STRETCH, "nu": 0.0}, {"degree": "angle"})


def rotation(angle: Array) -> Array:
    """Rotation matrices, shape (2, 2, m), of angles in degrees."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return np.array([[c, -s], [s, c]])


def stress(law: str, angle: Array) -> Array:
    """``S_11 / E`` of a bar stretched along its axis and then rotated, shape (m,).

    The second Piola-Kirchhoff stress of ``F = R(angle) diag(STRETCH, 1)``: its components are along
    the axes of the material, which turn with the bar.
    """
    return np.asarray(second_piola(rotation(angle) * np.array([STRETCH, 1.0])[:, None], _LAME, law)[0, 0])


def stiffness(law: str, angle: Array) -> Array:
    """Bending stiffness over ``D = E h^3 / 12`` of a strip whose section is rotated, shape (m,).

    Bent to the curvature ``kappa``, a strip whose tangent ``t`` is at ``angle`` has, at the distance ``zeta``
    from its mid-surface, the deformation gradient ``F = R diag(1 - kappa zeta, 1)``.  The traction on its
    section is ``P e_1``, and ``P_tt = t . P e_1`` its component along the rotated axis.  The moment
    ``M = -integral P_tt zeta d zeta`` works on a change of ``kappa``; the stiffness is ``dM / dkappa``
    at ``kappa = 0``, with the law's tangent and Gauss's rule over the thickness, which is exact here.
    """
    r = rotation(angle)
    zeta, weight = np.polynomial.legendre.leggauss(2)  # in units of h / 2
    total = np.zeros(r.shape[2])
    for z, w in zip(zeta, weight, strict=True):
        rate = r * np.array([-z, 0.0])[:, None]  # dF / dkappa
        change = product(rate, second_piola(r, _LAME, law)) + product(r, second_piola_rate(r, rate, _LAME, law))
        total += -w * z * np.sum(r[:, 0] * change[:, 0], axis=0)
    # Of zeta^2 over the same thickness: what a unit modulus gives.
    return total / float(weight @ zeta**2)


_SVK = r"$\mathbf{S} = \mathbf{C}:\mathbf{E}$"
_PRINTED = r"$\mathbf{S} = \det\mathbf{F}\,\mathbf{F}^{-1}(\mathbf{C}:\mathbf{E})\,\mathbf{F}^{-\top}$"
_LAWS = (
    ("svk", f"{_SVK} (St Venant-Kirchhoff, used here)", BLACK, "-"),
    ("printed", f"{_PRINTED} (as printed)", VERMILLION, "--"),
)
_PLACES = {0.0: ((4, -5), "left", "top"), 45.0: ((5, 0), "left", "bottom"), 90.0: ((-5, 5), "right", "bottom")}
"""Offset and alignment of the number beside the point at an angle."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw stress (a) and bending stiffness (b) over the angle of rotation, for both laws."""
    fig = figure(4.2)
    axes = top, bottom = fig.subplots(2, 1, sharex=True)
    marked = data.sel(angle=list(_PLACES), method="nearest")
    for ax, quantity in zip(axes, ("stress", "stiffness"), strict=True):
        for name, label, colour, line in _LAWS:
            ax.plot(data["angle"], data[f"{quantity}_{name}"], line, color=colour, label=label if ax is top else None)
        values = marked[f"{quantity}_printed"]
        ax.plot(values["angle"], values, "o", color=VERMILLION, clip_on=False)
        ax.set_ylim(0.0, 1.32 * float(values.max()))
    for one, (offset, ha, va) in zip(marked["stress_printed"], _PLACES.values(), strict=True):
        text = f"{float(one):.4f}" if one > 1e-9 else "0"
        text_at(top, (float(one["angle"]), float(one)), text, offset, ha=ha, va=va, color=VERMILLION)
    percent = 100.0 * (float(data.attrs["stretch"]) - 1.0)
    note(top, f"(a) bar stretched by {percent:.0f} %, then rotated")
    note(bottom, "(b) unstretched strip, rotated")
    top.set_ylabel(r"stress $S_{11}\,/\,E$")
    bottom.set(xlabel=r"angle of rotation $\varphi$ [deg]", ylabel=r"bending stiffness $/\,D$", xlim=(0.0, 90.0))
    bottom.xaxis.set_major_locator(MultipleLocator(15.0))
    legend_above(fig, ncols=1)
    fig.align_ylabels()
    return fig


def facts(d: xr.Dataset) -> Facts:
    """At a rotation by 90 degrees, over what the law gives unrotated."""
    upright, flat = d.sel(angle=90.0), d.sel(angle=0.0)
    return {
        "stiffness": upright.stiffness_printed / flat.stiffness_printed,
        "objective": upright.stiffness_svk / flat.stiffness_svk,
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("printed_law_stiffness", "stiffness", "1", "< 1e-6",
            "bending stiffness under the printed law of a strip rotated by 90 degrees over that of a level one; under "
            "the objective law {objective:.6f}"),
    ),
}
# fmt: on
