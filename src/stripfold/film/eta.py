"""eta_b of a fabric: by the height of its fold, a hanging loop, a bending test, or from one picture.

A picture shows the loop of a folded strip, a strip that hangs out of a clamp, or one that hangs as a loop.  The
interval covers what the picture says, scatter of the edges, light and the free end, and where the camera may have
stood.  The scale holds in the plane of the strip's near edge; behind it all is seen smaller, and the middle of the band
that is seen lies between both edges.  Beside a plate both edges are in the fit (:class:`.shape.Depth`).  Without one
nobody knows where the camera stood: eta_b may be up to 3/2 of the depth too high; a tilt of the camera shows a face of
the strip and shortens the picture; its roll turns the vertical, on which only a hanging strip depends.  The interval
then excludes the scale, an error of 1 % of which is one of 3 % of eta_b with either method.  It excludes friction and
plasticity of the cloth.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, degrees, exp, hypot, isnan, log, nan, radians, sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from stripfold.base.arguments import checked, file_name
from stripfold.base.arrays import Array, Picture
from stripfold.base.errors import InvalidInputError, TrackingError, require
from stripfold.base.material import GRAVITY, Material
from stripfold.base.validation import ETA_B
from stripfold.files import schema
from stripfold.files.reporting import Result, Rows, metres
from stripfold.film.fitted import FACE_SD, TILT_ERROR
from stripfold.film.request import KES_B, KES_HB, EtaRequest

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from stripfold.film.camera import Mapping
    from stripfold.film.plate import Seen
    from stripfold.film.shape import Depth, ShapeFit

TILT, ROLL, DEPTH = 3.0, 1.0, 0.05
"""Largest angles of the camera's axis to the strip's width, and of its rows to the horizontal, degrees, and largest
width of the strip over its distance from the camera, that are not excluded unless less is stated."""

PLATE_ROLL = 0.3
"""The same of the vertical by the plate, degrees: it stands on the table."""
MAX_TILT = 30.0
"""Largest angle, degrees, from which a strip beside the plate may be seen."""
USUAL_DEPTH = 0.1, 0.07
"""Width of a strip over the distance of its far edge's plane from the camera, and its standard deviation, where no
width is given: the band's own width says more where a face is seen."""
USUAL_THICKNESS = 1e-3, 1e-3
"""Thickness of a cloth and its standard deviation, m."""
KNOWN_DEPTH_SD, GUESSED_DEPTH_SD = 0.05, 0.15
"""Standard deviation of the same by a width, as a share: with the camera's focal length, and without."""

MAX_INTERVAL_RATIO = 30.0
"""Largest ratio of an interval's ends that is still called a measurement."""


@dataclass(frozen=True)
class View:
    """What is not excluded of the camera: ``tilt`` and ``roll``, degrees, and ``depth``, a share of its distance."""

    tilt: float = TILT
    roll: float = ROLL
    depth: float = DEPTH


@dataclass(frozen=True, eq=False, repr=False)
class EtaB(Result):
    """A measured weight-to-bending-stiffness ratio.

    Source: docs/measuring.md.

    Attributes
    ----------
    eta_b, interval
        m^-4 s^2; the 95 % interval is known from a picture only, else nan.
    gravity_length
        L*, m.
    friction_moment, friction_moment_star
        Friction moment in bending M_0, N and rho_a g L*^2; nan if it is not known.
    fit
        The shape fitted to a picture, pixels; None without one.
    image, scale, view
        The picture, grey values, m per pixel, and what is not excluded of the camera.
    scale_sd
        Standard deviation of the scale, as a share: by the plate, 0 where it was given.
    """

    eta_b: float
    gravity_length: float
    interval: tuple[float, float] = (nan, nan)
    friction_moment: float = nan
    friction_moment_star: float = nan
    fit: ShapeFit | None = None
    image: Any = None
    scale: float = nan
    view: View = View()
    scale_sd: float = 0.0
    title = "a weight-to-bending-stiffness ratio"
    shown = ("eta_b", "gravity_length")

    @classmethod
    def of(cls, asked: EtaRequest) -> EtaB:
        """Measure it; InvalidInputError: no picture or no eta_b of a strip; TrackingError: no strip in the picture."""
        found = _of_numbers(asked) if asked.image is None else _of_picture(asked, asked.image)
        if not ETA_B[0] <= found.eta_b <= ETA_B[1]:
            key = next((key for key in ("scale", "length", "gsm") if getattr(asked, key) is not None), "image")
            allowed = f"one that makes eta_b {ETA_B[0]:g} to {ETA_B[1]:g} m^-4 s^2; it would be {found.eta_b:.3g}"
            advice = "is the plate printed at 100 %?" if key == "image" else "are the units as asked?"
            raise InvalidInputError(key, getattr(asked, key), allowed, advice)
        return found

    @property
    def residual(self) -> float:
        """Root mean square of the distances between measured and fitted points, m; nan without a picture."""
        return nan if self.fit is None else self.fit.rms * self.scale

    def rows(self) -> Rows:
        rows = [("eta_b", f"{self.eta_b:.6g} m^-4 s^2")]
        if self.fit is None:
            rows.append(("L*", f"{self.gravity_length:.6g} m, Peirce's bending length"))
            text = f"{self.friction_moment_star:.4g} rho_a g L*^2, {self.friction_moment:.4g} N, friction"
            return rows if isnan(self.friction_moment) else [*rows, ("M_0", text)]
        (low, high), view = self.interval, self.view
        roll = f"roll up to {view.roll:.2g}, " if self.fit.method == "cantilever" else ""
        scale = f"scale by the plate within {196 * self.scale_sd:.1f} %" if self.scale_sd else "with the scale as given"
        camera = f"tilt up to {view.tilt:g} degrees, {roll}depth {view.depth:g}"
        if self.fit.depth is not None:
            camera = f"{roll}depth {self.fit.depth.share:.2g} of the camera's distance, by the band's width"
        return [
            *rows,
            ("  95 %", f"{low:.6g} to {high:.6g} m^-4 s^2, {scale}; {camera}"),
            ("L*", f"{self.gravity_length:.6g} m"),
            ("residual", metres(self.residual, "root mean square of measured less fitted")),
            *self.fit.rows(self.scale),
        ]

    def to_dict(self) -> dict[str, Any]:
        found: dict[str, Any] = {"eta_b": self.eta_b, "gravity_length": self.gravity_length}
        if self.fit is not None:
            low, high = self.interval
            bounds = {"eta_b": self.eta_b, "eta_b_lower": low, "eta_b_upper": high}
            found = {"method": self.fit.method} | bounds | found | {"residual": self.residual}
            return found | self.fit.numbers(self.scale)
        if not isnan(self.friction_moment):
            found |= {"friction_moment": self.friction_moment, "friction_moment_star": self.friction_moment_star}
        return found

    def to_dataset(self) -> xr.Dataset:
        low, high = self.interval
        values = {"eta_b": self.eta_b, "eta_b_lower": low, "eta_b_upper": high, "gravity_length": self.gravity_length}
        return schema.dataset({name: ((), value) for name, value in values.items()})

    def plot(self) -> Figure:
        """The fit over the picture."""
        if self.fit is None:
            raise InvalidInputError("image", None, "a picture", "without one there is nothing to draw")
        from stripfold.film import eta_figure

        return eta_figure.draw(self)


def _of_picture(asked: EtaRequest, file: str) -> EtaB:
    """eta_b by a picture: of the fold in it, or else of the loop or the strip that hangs, where that is not given."""
    require("vision")
    from stripfold.film.pictures import focal_of, read_grey

    view = asked.model_dump(include={"tilt", "roll", "depth"}, exclude_none=True)
    name, image = Path(file).name, read_grey(file)
    failures = []
    for method in ("fold", "loop", "cantilever") if asked.method is None else (asked.method,):
        try:
            if asked.scale is not None:
                return from_image(image, asked.scale, method, name, asked.slope, View(**view))
            focal = focal_of(file)
            return from_plate(image, method, name, asked.slope, width=asked.width, focal=focal, **view)
        except TrackingError as error:
            failures.append(error)
    if len({failure.found for failure in failures}) == 1:
        raise failures[0]
    fold, loop, hangs = (failure.found for failure in failures)
    found = f"neither a fold ({fold}), nor a hanging loop ({loop}), nor a hanging strip ({hangs})"
    raise TrackingError(name, found, "one of them", "say which with method, and what is wrong with it is said alone")


def from_image(
    image: Picture,
    scale: float,
    method: str,
    source: str = "picture",
    slope: float | None = None,
    view: View | None = None,
) -> EtaB:
    """Measure eta_b in the grey values of an upright picture, shape (h, w), with ``scale`` metres per pixel.

    ``method``: of :func:`eta_b`, or "loop" for a heart or a pear.  ``slope``, degrees: see there.  ``view``: what is
    not excluded of the camera.  Raises TrackingError: no strip as the method needs it.
    """
    view = view or View()
    return _found(_fit(image, method, source, slope, view.roll), image, scale, source, view)


def from_plate(
    image: Picture,
    method: str,
    source: str = "picture",
    slope: float | None = None,
    roll: float = PLATE_ROLL,
    width: float | None = None,
    focal: float | None = None,
) -> EtaB:
    """Measure eta_b in the grey values of a picture, shape (h, w), that shows a plate beside the strip.

    ``roll``: largest angle of the plate's foot to the horizontal, degrees.  ``width`` of the strip, m, and ``focal``,
    length of the camera over the picture's longer side, say how far its far edge is behind the near one, beside what
    its band says; without a ``focal`` that of a phone is taken, the first with which there is a strip.

    Raises TrackingError: no plate, a camera that looks from far aside, or no strip as the method needs.
    """
    from stripfold.film import plate

    found, failure = plate.find(image, source), None
    for tried in plate.FOCALS if focal is None else (focal,):
        seen = found.with_focal(tried, plate.FOCAL_SD if focal is None else plate.KNOWN_FOCAL_SD)
        try:
            return _beside(image, seen, method, source, slope, roll, width, known=focal is not None)
        except TrackingError as error:
            failure = failure or error
    assert failure is not None
    raise failure


def _beside(
    image: Picture,
    seen: Seen,
    method: str,
    source: str,
    slope: float | None,
    roll: float,
    width: float | None,
    known: bool,
) -> EtaB:
    """Measure eta_b beside a plate; ``known``: whether the focal length is."""
    from stripfold.film import plate
    from stripfold.film.shape import Depth

    straight = plate.rectified(image, seen)
    *foot, away = seen.mapping.camera_place
    share, share_sd = USUAL_DEPTH
    if width is not None:
        share = width / (float(away) + width)
        share_sd = share * (KNOWN_DEPTH_SD if known else GUESSED_DEPTH_SD)
    thickness, thickness_sd = (of / straight.scale for of in USUAL_THICKNESS)
    depth = Depth(straight.pixels(np.array([foot]))[0], share, share_sd, (thickness, thickness_sd))
    random = np.random.default_rng(0)
    draws = [seen.resample(random) for _ in range(plate.DRAWS)]
    roll = hypot(roll, 1.96 * _upright_sd(seen.mapping, draws, plate.outline(seen.board)))
    fit = _fit(straight.image, method, source, slope, roll, depth)
    place = straight.places(fit.curve.mean(axis=0)[None])
    aside = degrees(atan2(float(np.linalg.norm(place[0] - foot)), float(away)))
    if aside > MAX_TILT:
        found = f"a strip that is seen from {aside:.0f} degrees aside"
        raise TrackingError(source, found, f"at most {MAX_TILT:g}", "hold the camera in front of the strip")
    sizes = [one.resolution(one.to_pixels(place)[0]) for one in draws]
    scale_sd = hypot(plate.PRINT_SD, plate.PLACE_SD / float(away), float(np.std(np.log(sizes))))
    return _found(fit, straight.image, straight.scale, source, View(0.0, roll, 0.0), scale_sd)


def _upright_sd(mapping: Mapping, draws: Sequence[Mapping], outline: Array) -> float:
    """Standard deviation of the vertical, degrees, a plate's length beside it, by mappings drawn as that one."""
    (left, top), (right, _) = outline
    sides = np.array([2.0 * left - right, 2.0 * right - left])
    feet, tops = (np.column_stack([sides, np.full(2, z)]) for z in (0.0, top))
    ways = np.array([mapping.to_robot(one.to_pixels(tops)) - mapping.to_robot(one.to_pixels(feet)) for one in draws])
    return float(np.degrees(np.std(np.arctan2(ways[..., 0], ways[..., 1]), axis=0)).max())


def _fit(
    image: Picture, method: str, source: str, slope: float | None, roll: float, depth: Depth | None = None
) -> ShapeFit:
    from stripfold.film import cantilever, fold, hanging_loop

    if method == "fold":
        return fold.measure(image, source, depth)
    if method != "cantilever":
        kinds = tuple(kind for kind in hanging_loop.KINDS if method in (kind, "loop"))
        return hanging_loop.measure(image, kinds, source, depth)
    return cantilever.measure(image, source, None if slope is None else radians(slope), radians(roll), depth)


def _found(fit: ShapeFit, image: Picture, scale: float, source: str, view: View, scale_sd: float = 0.0) -> EtaB:
    """The result, with the interval however the camera stood within its view.

    Of a strip whose depth is known the middle of the band that is seen is smaller by half of it; else the middle may be
    anywhere between both edges, and the tilt is not known either.
    """
    share, sd = (0.0, 0.0) if fit.depth is None else (fit.depth.share, fit.depth.sd)
    middle = (1.0 - 0.5 * share) ** 3
    low, high = ((fit.unit / unit) ** 3 for unit in reversed(fit.interval))
    spread = 1.96 * hypot(3.0 * scale_sd, 1.5 * sd, FACE_SD[fit.method] * share)
    tilted = TILT_ERROR[fit.method] * view.tilt
    eta_b = eta_b_of(fit.unit * scale) * middle
    interval = (
        eta_b * exp(-hypot(log(low), spread)) * (1.0 - tilted) * (1.0 - 0.5 * view.depth) ** 3,
        eta_b * exp(hypot(log(high), spread)) * (1.0 + tilted),
    )
    if interval[1] > MAX_INTERVAL_RATIO * interval[0]:
        found = f"the strip's shape leaves eta_b anywhere from {interval[0]:.3g} to {interval[1]:.3g} m^-4 s^2"
        needed = f"an interval narrower than a factor {MAX_INTERVAL_RATIO:g}"
        raise TrackingError(source, found, needed, "let 1 to 4 L* of it hang")
    unit = Material(eta_b).gravity_length
    return EtaB(eta_b, unit, interval, fit=fit, image=image, scale=scale, view=view, scale_sd=scale_sd)


def _of_numbers(asked: EtaRequest) -> EtaB:
    """eta_b without a picture."""
    from stripfold import elastica

    rho_a = nan
    if asked.fold_height is not None:
        eta_b = elastica.eta_b_from_fold_height(asked.fold_height)
    elif asked.loop is not None:
        assert asked.length is not None  # the request has checked both
        assert asked.height is not None
        eta_b = elastica.eta_b_from_hanging_loop(asked.loop, asked.length, asked.height)
    elif asked.bending_length is not None:
        eta_b = eta_b_of(asked.bending_length)
    else:
        assert asked.gsm is not None  # the request has one of the sources
        rigidity = asked.rigidity if asked.kes_b is None else KES_B * asked.kes_b
        assert rigidity is not None
        rho_a = 1e-3 * asked.gsm
        eta_b = rho_a / rigidity
    unit = Material(eta_b).gravity_length
    moment = nan if asked.kes_2hb is None else 0.5 * KES_HB * asked.kes_2hb
    return EtaB(eta_b, unit, friction_moment=moment, friction_moment_star=moment / (rho_a * GRAVITY * unit**2))


class Together(NamedTuple):
    """What several pictures of one cloth say: the geometric mean of their eta_b, its 95 % interval, m^-4 s^2, and their
    scatter, a standard deviation as a share.
    """

    eta_b: float
    interval: tuple[float, float]
    scatter: float


def together(found: Sequence[EtaB]) -> Together:
    """Combine two or more pictures: what is uncertain in each, as the scale, may be so in the same way in all.

    The interval is the median one of a picture, widened by the error of the mean of what differs between them.
    """
    from scipy.special import stdtrit

    logs = np.log([one.eta_b for one in found])
    low, high = np.median(np.log([one.interval for one in found]) - logs[:, None], axis=0)
    scatter = float(np.std(logs, ddof=1))
    of_mean = float(stdtrit(len(logs) - 1, 0.975)) * scatter / sqrt(len(logs))
    ends = np.exp(logs.mean() + np.array([-np.hypot(low, of_mean), np.hypot(high, of_mean)]))
    return Together(float(np.exp(logs.mean())), (float(ends[0]), float(ends[1])), scatter)


def eta_b_of(unit: float) -> float:
    """Compute eta_b, m^-4 s^2, from L*, m."""
    return 1.0 / (GRAVITY * unit**3)


@checked
def eta_b(
    *,
    fold_height: float | None = None,
    image: str | os.PathLike[str] | None = None,
    scale: float | None = None,
    ruler: str | None = None,
    method: Literal["fold", "cantilever", "heart", "pear"] | None = None,
    slope: float | None = None,
    tilt: float | None = None,
    roll: float | None = None,
    depth: float | None = None,
    width: float | None = None,
    bending_length: float | None = None,
    rigidity: float | None = None,
    kes_b: float | None = None,
    kes_2hb: float | None = None,
    gsm: float | None = None,
) -> EtaB:
    """The weight-to-bending-stiffness ratio of a fabric.

    Parameters
    ----------
    fold_height
        Height of the loop of a strip folded in half, m; or
    image
        a picture, upright, of such a loop, of a strip that hangs out of a clamp, or of a heart or pear loop, with
    scale
        m per pixel, or
    ruler
        "x1,y1,x2,y2,length": two marks of a ruler in it, pixels, and their distance, m; without either it shows the
        plate, by which it is seen straight; and
    method
        "fold", "cantilever", a strip that hangs, "heart" or "pear", one that hangs from both ends, which point upwards
        or downwards; what is found in the picture if left out.
    slope
        Angle of a cantilever below the horizontal at its clamp, degrees; fitted if left out.
    tilt, roll, depth
        What is not excluded of the camera, and so part of the interval: the angles of its axis to the strip's width and
        of its rows to the horizontal, degrees, and the strip's width over its distance; 3, 1 and 0.05 if left out, tilt
        and roll beside the plate by that.
    width
        Of the strip beside the plate, m: the middle of the band that is seen lies behind the near edge.
    bending_length
        Peirce's bending length, m: it is L*; or
    rigidity
        bending stiffness per width, N m; or
    kes_b, kes_2hb
        B, gf cm^2/cm, of Kawabata's test and, if known, its 2HB, gf cm/cm: the friction; these or the rigidity with
    gsm
        weight per area, g/m^2.

    Raises
    ------
    InvalidInputError
        A value that cannot be used.
    MeasurementError
        The picture shows no such strip.

    Examples
    --------
    >>> import stripfold as sf
    >>> round(sf.eta_b(fold_height=0.0272).eta_b, 1)
    3774.6
    """
    given = dict(locals())
    return EtaB.of(EtaRequest(**given | {"image": None if image is None else str(file_name("image", image))}))
