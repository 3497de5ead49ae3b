"""eta_b from the motion of a strip that follows its gripper, before it snaps.

Where the free end lay, how far it has been moved and how high it is held are known from the robot; with them the shape
depends on L* alone, and far more than the picture's scale would tell: at a given advance it moves by 2 L* for each unit
of ln L* in the first frames, and by 10 L* near the snap.  Beside L* are fitted

* the depth behind the folding plane at which the strip is seen, since the tracked line is about the middle of its
  width; where the camera is follows from the calibration;
* the friction moment M_0, if it is not described, to first order (:mod:`.elastica.with_friction`);
* errors of the gripper's place, as far as their standard deviation allows.

The same shapes tell what is wrong with a given flat end or offset: see :class:`Pull`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from math import hypot, isfinite, log, nan

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.base.errors import MeasurementError, SolveError
from stripfold.base.material import GRAVITY, Material
from stripfold.elastica import with_friction
from stripfold.film import snap
from stripfold.film.camera import Mapping
from stripfold.film.fitted import DEPTH_SD, FRICTION_SD, MAX_MISFIT, PULL_SD, USUAL_MISFIT
from stripfold.film.recording import DEVIATIONS, NAME, SD_95, Entries, GripperEntry, Recording, StripEntry
from stripfold.film.shape import correlation_length
from stripfold.film.tracking import Tracks

MARGIN = 0.3
"""How far before the onset of the snap the last shape is, L*: from there on the strip no longer follows its gripper."""
SHAPES, MIN_FRAMES = 10, 5
"""Number of shapes, each the mean of successive frames; least number of frames."""
ENDS = 2
"""Stations at each end of the strip that are left out: fingers hide them."""
ASIDE_SD = 0.6
"""Standard deviation of the depth by which a strip is fitted that is seen from aside, in widths."""
WIDTH = 0.04
"""Width of a strip of which none is described, m: the middle of what docs/measuring.md asks for."""
PLACE_SD = 2e-4
"""Standard deviation of the errors of the flat end and of the height that are fitted, m."""
MAX_FRICTION = 0.1
"""Largest M_0, rho_a g L*^2, that the first order describes."""
DESCRIBED_FRICTION_SD = 0.008
"""Standard deviation of a described M_0, as a share."""
STARS = 1.7, 60.0
"""Heights for which a snap is looked for, L*: below 1.59 there is none."""
MAX_CHANGE = 0.5
"""Largest change of ln L* by the fit: friction delays the snap by less."""
STEPS = np.array([1e-4, 3e-3, 1e-3, 3e-4, 3e-4, 3e-4])
"""Steps of the differences by the unknowns, L* except for the first, a logarithm: L*, depth, M_0 / (rho_a g L*), errors
of advance, height and flat end."""
FURTHER, HIGHER, END = 3, 4, 5
"""Places of the last three among the unknowns."""
NAMES = "eta_b_motion", "eta_b_motion_low", "eta_b_motion_high", "friction_motion", "misfit"
"""Names in files: eta_b, the ends of its interval, M_0, and the standard deviation of most residuals of the shapes."""
PULLED = "flat_end", "offset"
"""Given numbers of which the shapes tell whether they are right."""


@dataclass(frozen=True)
class Pull:
    """What the shapes say of a given number: that it is ``off`` by so much, m, with a standard deviation ``sd``, m, of
    the given number and of what the shapes say together; ``name``: one of :data:`PULLED`; ``key``, ``value``: its entry
    and what is given, m.
    """

    name: str
    key: str
    value: float
    off: float
    sd: float

    @property
    def deviations(self) -> float:
        """Difference in standard deviations."""
        return self.off / self.sd

    def __str__(self) -> str:
        return f"gripper.{self.key} = {self.value:g} m, by the strip's shapes it is {self.value + self.off:.4f} m"


class ContradictionError(MeasurementError):
    """A given number that the film contradicts."""

    def __init__(self, pull: Pull) -> None:
        needed = f"at most {1e3 * DEVIATIONS * pull.sd:.1f} mm between them"
        super().__init__(NAME, str(pull), needed, f"measure it again, or give {pull.key}_uncertainty")


class MisfitError(MeasurementError):
    """Shapes that are not those of a strip with one eta_b: ``residual`` off them, m, with this L*, m."""

    def __init__(self, residual: float, unit: float) -> None:
        self.residual, self.unit = residual, unit
        found = f"shapes {residual / unit:.1%} of L* off those of a strip with one eta_b"
        super().__init__("video", found, f"{MAX_MISFIT:.0%} or less", "is its law of bending linear?")


@dataclass(frozen=True)
class MotionEtaB:
    """eta_b from the motion with its 95 % interval, m^-4 s^2.

    ``friction``: M_0, rho_a g L*^2; ``known``: whether it was described.  ``depth`` of the strip behind the folding
    plane, m; ``residual``: standard deviation of most points from the fitted shapes, m; ``frames``: their number;
    ``pulls``: what the shapes say of the flat end and, where there is no log, of the offset.
    """

    eta_b: float
    low: float
    high: float
    friction: float
    known: bool
    depth: float
    residual: float
    frames: int
    pulls: tuple[Pull, ...]

    @property
    def unit(self) -> float:
        """L*, m."""
        return Material(self.eta_b).gravity_length

    def contradicts(self, strip: StripEntry) -> str:
        """What to say of a described strip whose eta_b is another; empty where both agree."""
        given = strip.eta_b_interval or (strip.eta_b, strip.eta_b)
        halves = (0.5 * log(high / low) for low, high in (given, (self.low, self.high)))
        if abs(log(strip.eta_b / self.eta_b)) <= DEVIATIONS * SD_95 * hypot(*halves):
            return ""
        interval = f"{self.low:.4g} to {self.high:.4g} m^-4 s^2"
        return f"by the strip's motion eta_b is {interval}, described is {strip.eta_b:.4g}"


@dataclass(frozen=True, eq=False)
class _Seen:
    """What is fitted: lengths in m, x from where the free end lay when flat, in the direction of the advance.

    Of the k shapes, ``advance`` has shape (k,) and ``points`` shape (k, n, 2); ``distance``, shape (n,), is from the
    gripper along the strip.  ``camera`` has its x, z and distance from the folding plane; ``height`` is the gripper's.
    ``expected`` and ``sd``, shape (6,), are those of the unknowns: ln L*, depth, M_0 / (rho_a g), and errors of the
    gripper's place, of its height and of the flat end; one with a deviation of 0 is not fitted.
    """

    advance: Array
    points: Array
    distance: Array
    camera: Array
    height: float
    expected: Array
    sd: Array

    def residuals(self, values: Array) -> Array:
        """Distances of the points from the shape, along its normals, shape (k, n), m."""
        log_unit, depth, friction, further, higher, end = values
        unit = float(np.exp(log_unit))
        branch = with_friction.branch((self.height + higher) / unit)
        curve = unit * branch.shapes(friction / unit**2, (self.advance + further - end) / unit, self.distance / unit)
        curve[..., 0] += end
        # The sight line through a point behind the folding plane crosses it nearer to the camera's foot.
        nearer = depth / (self.camera[2] + depth)
        curve = curve + nearer * (self.camera[:2] - curve)
        along = np.gradient(curve, axis=1)
        along /= np.linalg.norm(along, axis=2, keepdims=True)
        away = self.points - curve
        return np.asarray(away[..., 1] * along[..., 0] - away[..., 0] * along[..., 1])


def measure(
    recording: Recording,
    mapping: Mapping,
    tracks: Tracks,
    event: float,
    by_video: float,
    snapped: bool,
    place_sd: tuple[float, float, float],
    aside: bool = False,
) -> MotionEtaB | MeasurementError:
    """Fit eta_b to the frames in which the strip follows its gripper, or say why there is none.

    ``event``, ``by_video``: advance at the onset of the snap, or at the end where there was none, and by the video
    alone, m.  ``place_sd``: standard deviations of the flat end, of the offset and by the calibration, m.  ``aside``:
    the offset is fitted, too, and the camera, whose distance is known roughly, sees the strip from aside.

    Raises ContradictionError: the shapes are a strip's, but with another flat end or offset than the given one; not
    where the strip is seen from ``aside``.
    """
    try:
        return _measure(recording, mapping, tracks, event, by_video - event, snapped, place_sd, aside)
    except ContradictionError:
        raise
    except MeasurementError as error:
        return error
    except SolveError as error:
        return MeasurementError("video", f"no shape of a strip: {error}", "one with an eta_b")


def numbers(found: MotionEtaB | MeasurementError) -> dict[str, float]:
    """The numbers of the result by their names in files."""
    values = dict.fromkeys((*NAMES, *(name + end for name in PULLED for end in ("_off", "_off_sd"))), nan)
    if isinstance(found, MeasurementError):
        return values | ({"misfit": found.residual} if isinstance(found, MisfitError) else {})
    values |= zip(NAMES, (found.eta_b, found.low, found.high, found.friction, found.residual), strict=True)
    for pull in found.pulls:
        values |= {f"{pull.name}_off": pull.off, f"{pull.name}_off_sd": pull.sd}
    return values


def doubted(found: MotionEtaB | MeasurementError) -> str:
    """What to say where the strip is not seen as it is described; empty where it is."""
    if not isinstance(found, MotionEtaB | MisfitError) or found.residual < 2.0 * USUAL_MISFIT * found.unit:
        return ""
    off = f"{1e3 * found.residual:.2f} mm, {found.residual / found.unit:.1%} of L*"
    asked = "are gripper.flat_end, height and offset right, and does the strip not twist?"
    return f"the strip's shapes are {off}, off those of any strip, usual is {USUAL_MISFIT:.1%}: {asked}"


def _measure(
    recording: Recording,
    mapping: Mapping,
    tracks: Tracks,
    until: float,
    error: float,
    snapped: bool,
    place_sd: tuple[float, float, float],
    aside: bool,
) -> MotionEtaB:
    """The same with the ``error`` of advances by the video, m; raises :class:`MeasurementError`."""
    entries = recording.entries
    strip, gripper = entries.strip, entries.gripper
    unit = Material(strip.eta_b).gravity_length if not snapped else _unit_at_snap(gripper.height, until)
    start, _ = snap.steady_advance(tracks.grip_time, gripper.direction * tracks.gripped_end[:, 0])
    x = np.interp(tracks.strip_time, tracks.grip_time, tracks.gripped_end[:, 0])
    advance = gripper.direction * (x - gripper.flat_end) - error
    used = np.flatnonzero(tracks.seen & (tracks.strip_time >= start) & (advance <= until - MARGIN * unit))
    if len(used) < MIN_FRAMES:
        advice = f"film from farther before the snap: {MARGIN:g} L* before it the strip no longer follows its gripper"
        raise MeasurementError("video", f"{len(used)} frames for eta_b", f"at least {MIN_FRAMES}", advice)
    groups = np.array_split(used[np.argsort(advance[used])], min(SHAPES, len(used) // 3))
    mirror, origin = np.array([gripper.direction, 1.0]), np.array([gripper.flat_end, 0.0])
    points = mirror * (tracks.points - origin)
    camera = mapping.camera_place
    flat_end_sd, offset_sd, mapping_sd = place_sd
    fitted_sd = float(np.hypot(PLACE_SD, mapping_sd))
    further_sd = float(np.hypot(fitted_sd, offset_sd)) if aside else fitted_sd
    width = strip.width or WIDTH
    depth_sd = (ASIDE_SD if aside else DEPTH_SD) * width
    known, friction = False, 0.0
    if strip.friction_moment is not None and strip.rho_a is not None:
        known, friction = True, strip.friction_moment / (strip.rho_a * GRAVITY)
    seen = _Seen(
        advance=np.array([advance[group].mean() for group in groups]),
        points=np.array([points[group].mean(axis=0) for group in groups])[:, ENDS:-ENDS],
        distance=tracks.stations[ENDS:-ENDS],
        camera=np.append(mirror * (camera[:2] - origin), camera[2]),
        height=float(np.median(tracks.gripped_end[used, 1])),
        expected=np.array([np.log(unit), 0.5 * width, friction, 0.0, 0.0, 0.0]),
        # What a fit would make of M_0 is worse than what a bending test says.
        sd=np.array([np.inf, depth_sd, 1e-4 * unit**2 if known else np.inf, further_sd, fitted_sd, 0.0]),
    )
    asked = [(END, flat_end_sd)] if recording.robot_log is not None else [(END, flat_end_sd), (FURTHER, offset_sd)]
    others_sd = max(flat_end_sd, offset_sd)
    pulls = tuple(pull for which, sd in asked if (pull := _pull(seen, gripper, which, sd, others_sd)) is not None)
    for pull in () if aside else sorted(pulls, key=lambda pull: -abs(pull.deviations)):
        if abs(pull.deviations) > DEVIATIONS:
            raise ContradictionError(pull)
    values, covariance, residual = _fitted(seen)
    unit = float(np.exp(values[0]))
    if values[2] > 0.99 * MAX_FRICTION * unit**2:
        found = f"friction of {MAX_FRICTION:g} rho_a g L*^2 or more"
        raise MeasurementError("video", found, "less: it is considered to first order")
    if not residual <= MAX_MISFIT * unit:
        raise MisfitError(residual, unit)
    friction_sd = DESCRIBED_FRICTION_SD * friction if known else FRICTION_SD * unit**2
    # Of the flat end and of the height the fit takes small errors only: so a wrong description is seen in the misfit.
    known_sd = np.array([friction_sd, flat_end_sd if aside else np.hypot(flat_end_sd, offset_sd), offset_sd])
    sd_log = np.linalg.norm([np.sqrt(covariance[0, 0]), *(known_sd * covariance[0, 2:] / np.diag(covariance)[2:])])
    spread = float(np.exp(3.0 * 1.96 * sd_log))
    eta_b = 1.0 / (GRAVITY * unit**3)
    return MotionEtaB(
        eta_b,
        eta_b / spread,
        eta_b * spread,
        float(values[2]) / unit**2,
        known,
        float(values[1]),
        residual,
        len(used),
        pulls,
    )


def _unit_at_snap(height: float, advance: float) -> float:
    """L*, m, of the strip that without friction snaps at this advance, m: with more stiffness it snaps later."""
    ratio, log_star = _snaps()
    if not ratio[0] <= advance / height <= ratio[-1]:
        found = f"a snap at an advance of {advance / height:.3g} times the gripper's height"
        raise MeasurementError("video", found, "one at which a strip snaps without friction")
    return height / float(np.exp(CubicSpline(ratio, log_star)(advance / height)))


@cache
def _snaps() -> tuple[Array, Array]:
    """Advance over height at the snap, ascending, and the logarithm of the height, L*; between them to 1e-3."""
    stars = np.geomspace(*STARS[::-1], 16)
    return np.array([elastica.critical(star).advance / star for star in stars]), np.log(stars)


def _fitted(seen: _Seen) -> tuple[Array, Array, float]:
    """The unknowns, the covariance of those that are fitted, and the standard deviation of most of the residuals, m."""
    values, noise, count = seen.expected, 0.01 * float(np.exp(seen.expected[0])), 50.0
    fitted = seen.sd > 0.0
    bounded = fitted & np.isfinite(seen.sd)
    low, high = np.full((2, len(values)), [[-np.inf], [np.inf]])
    unit = float(np.exp(values[0]))
    scales = STEPS * np.array([1.0, unit, unit**2, unit, unit, unit])
    low[2], high[2] = 0.0, MAX_FRICTION * unit**2
    low[0], high[0] = values[0] - MAX_CHANGE, values[0] + MAX_CHANGE

    def all_of(some: Array) -> Array:
        values = seen.expected.copy()
        values[fitted] = some
        return values

    def rows(some: Array) -> Array:
        values = all_of(some)
        prior = np.sqrt(count) * ((values - seen.expected)[bounded] / seen.sd[bounded])
        data = seen.residuals(values).ravel() / noise
        # The squares of these grow like the residuals where those are large: outliers count less.
        data = np.sign(data) * np.sqrt(2.0 * (np.sqrt(1.0 + data**2) - 1.0))
        return np.concatenate([data, prior])

    def jacobian(some: Array) -> Array:
        at = rows(some)
        return np.column_stack([(rows(some + step) - at) / step.sum() for step in np.diag(scales[fitted])])

    for _ in range(2):
        start = np.clip(values, low + 1e-9, high - 1e-9)[fitted]
        # A thousandth of the interval is enough.
        limits = {"xtol": 1e-5, "ftol": 1e-6, "max_nfev": 40}
        bounds = low[fitted], high[fitted]
        values = all_of(least_squares(rows, start, jacobian, bounds, x_scale=100.0 * scales[fitted], **limits).x)
        residuals = seen.residuals(values)
        # Half of the points lie on the table, where any strip fits.
        noise = float(np.quantile(np.abs(residuals), 0.8)) / 1.28
        # Errors of neighbours on the strip are correlated, those of one place over time are the same.
        count = len(residuals) * correlation_length(residuals.mean(axis=0))
    slopes = jacobian(values[fitted])
    covariance = count * np.asarray(np.linalg.inv(slopes.T @ slopes))
    return values, covariance, noise


def _pull(seen: _Seen, gripper: GripperEntry, unknown: int, given_sd: float, others_sd: float) -> Pull | None:
    """What the shapes say of the flat end or of the offset; None where they are no strip's with any value of it.

    ``unknown``: its place among the unknowns.  ``given_sd``, ``others_sd``: standard deviations of the given number,
    and of the other one and of the height, m.
    """
    sd = seen.sd.copy()
    sd[[FURTHER, HIGHER, END]] = np.hypot(others_sd, sd[FURTHER])
    sd[unknown] = np.inf
    try:
        values, covariance, residual = _fitted(replace(seen, sd=sd))
    except np.linalg.LinAlgError:  # beyond the snap shapes do not depend on the advance
        return None
    unit = float(np.exp(values[0]))
    if not residual <= MAX_MISFIT * unit:
        return None
    name, key, known = "flat_end", "flat_end", gripper.flat_end
    if unknown == FURTHER:
        holder = "marker" if gripper.marker else "template"
        name, key, known = "offset", f"{holder}.offset", gripper.holder.offset[0]
    off = gripper.direction * float(values[unknown])
    variance = given_sd**2 + (PULL_SD[name] * unit) ** 2 + covariance[unknown, unknown]
    return Pull(name, key, known, off, float(np.sqrt(variance)))


@dataclass(frozen=True)
class ModelValue:
    """lambda_c of the elastica at the described height, m; nan where the sag touches the lower layer before a snap.

    ``low``, ``high``: its 95 % interval from that of eta_b; ``with_friction``: by :func:`.elastica.friction_delay`; nan
    where none was given.
    """

    without_friction: float
    low: float
    high: float
    with_friction: float


def model_value(entries: Entries) -> ModelValue:
    """The model's lambda_c for a recording's strip and height."""
    strip, height = entries.strip, entries.gripper.height

    def lambda_c(eta_b: float) -> float:
        unit = Material(eta_b).gravity_length
        return elastica.critical(height / unit).advance * unit

    value, low, high, with_friction = lambda_c(strip.eta_b), nan, nan, nan
    if strip.eta_b_interval is not None:
        ends = [lambda_c(eta_b) for eta_b in strip.eta_b_interval]
        if all(map(isfinite, (value, *ends))):
            low, high = sorted(ends)
    if strip.friction_moment is not None and strip.rho_a is not None:
        unit = Material(strip.eta_b).gravity_length
        moment = strip.friction_moment / (strip.rho_a * GRAVITY * unit**2)
        with_friction = value + elastica.friction_delay(height / unit) * moment * unit
    return ModelValue(value, low, high, with_friction)
