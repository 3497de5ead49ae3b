"""The critical point of a strip whose gripper advances at constant height: found to an accuracy, in SI."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import asdict, dataclass, field
from math import nan
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stripfold import elastica
from stripfold.ask import select_model
from stripfold.ask.inputs import Scene
from stripfold.ask.prediction import (
    ElasticaPrediction,
    Snap,
    from_near_the_end,
    snap,
    without_horizontal_force,
)
from stripfold.ask.second_gripper import SecondAlongX, second_gripper
from stripfold.ask.select_model import solid_error
from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.files import schema
from stripfold.files.reporting import Progress, Result, Rows, metres
from stripfold.follow.contact_branch import clearance
from stripfold.follow.statics import LAMBDA_TOLERANCE, StripModel, solve_height
from stripfold.follow.track import End, Track

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

ELASTICA_ERROR = 1e-9
"""Error of the elastica's lambda_c, L*, held by its tests."""
POINTS = 200
"""Points of the elastica's mid-surface."""
BY_ROD = "computed with the rod: too little of the strip is left on the floor for the solid"
BRACKET = 0.01
"""Width of the bracket of lambda_c as a share of the accuracy."""


@dataclass(frozen=True, slots=True)
class EtaBRange:
    """The ends of an advance with the least and the largest eta_b, in this order.

    ``eta_b``: both, m^-4 s^2.  ``snap``: whether the strip snaps; else the sag touches first.  ``advance``: lambda_c,
    or the advance at the touch.  ``margin``: height of the gripper above the touch limit, from which on a strip snaps.
    """

    eta_b: tuple[float, float]
    snap: tuple[bool, bool]
    advance: tuple[float, float]
    margin: tuple[float, float]


@dataclass(frozen=True, eq=False, repr=False)
class CriticalPoint(Result):
    """The critical point of a strip whose gripper advances at constant height; lengths in m, nan where there is none.

    Source: the paper's section III; docs/physics.md, sections 4 and 5.

    Attributes
    ----------
    lambda_c
        Advance of the gripper past the flat end at the snap.
    lambda_touch, touch_x
        Where there is none: advance at which the sag touches the lower layer, and where, origin mid-strip.
    error
        Estimated error of lambda_c or lambda_touch by mesh and bracket: its distance from that of the same model on
        elements that vanish along the strip.
    lambda_c_lower, lambda_c_upper
        Its bracket on the mesh used.
    lambda_0
        Advance without horizontal force, where the motion starts.
    x_c
        Gripper at the snap, in the frame with its origin mid-strip.
    free_length
        Length off the floor where the advance ends.
    snap, reason
        Whether the strip snaps, and what ends the advance.
    model, model_error
        The model used, and a bound of the distance of its advance from the solid's, the paper's model with one
        biquadratic element across; 0 for the solid.
    solid_error
        A bound of that solid's own distance from the exact two-dimensional one, which no accuracy includes: 2e-4 of
        lambda_c at h = 0.06 L*, 3e-3 at 0.2 L*, seven times as much at nu = 0.49.  nan for the printed law.
    seconds
        Run time.
    state
        Shape (n, 2): x and z of the mid-surface where the advance ends, from the gripped end; empty where the strip is
        too short for such a state.
    eta_b_range
        The ends of the advance for an uncertain eta_b; None where no uncertainty is given.
    second_gripper
        What a second gripper gains; None where none is asked for or the strip does not snap.
    scene
        The inputs.
    """

    lambda_0: float
    lambda_c: float
    x_c: float
    lambda_c_lower: float
    lambda_c_upper: float
    error: float
    lambda_touch: float
    touch_x: float
    free_length: float
    snap: bool
    reason: str
    seconds: float
    model: str
    model_error: float
    solid_error: float
    state: Array = field(repr=False)
    eta_b_range: EtaBRange | None
    second_gripper: SecondAlongX | None
    scene: Scene
    title = "a critical point"
    shown = ("model", "snap", "lambda_c", "lambda_touch", "error")

    def rows(self) -> Rows:
        scene, ends = self.scene, self.eta_b_range
        size = f"length {scene.length_star:.4g} L*, height {scene.height_star:.4g} L*"
        if self.snap:
            end = [
                ("lambda_c", metres(self.lambda_c, "advance past the flat end at the snap")),
                ("  between", f"{self.lambda_c_lower:.9f} and {self.lambda_c_upper:.9f} m"),
            ]
            place = [("x_c", metres(self.x_c, "gripper in the frame with its origin mid-strip"))]
        else:
            end = [("touch at", metres(self.lambda_touch, "advance past the flat end, lambda_touch"))]
            place = [("touch_x", metres(self.touch_x, "there, in the frame with its origin mid-strip"))]
        return [
            ("model", f"{self.model}; L* = {scene.gravity_length:.5g} m, {size}"),
            ("snap", f"{'yes' if self.snap else 'no'}: {self.reason}"),
            ("lambda_0", metres(self.lambda_0, "advance of the gripper without horizontal force")),
            *end,
            ("  error", metres(self.error, "estimated, of mesh and bracket")),
            ("  model", metres(self.model_error, "largest distance from the solid's")),
            ("  solid", metres(self.solid_error, "largest distance of the solid's from the exact one")),
            *place,
            ("free length", metres(self.free_length, "off the floor where the advance ends")),
            *([] if ends is None else self._range_rows(ends)),
            *([] if scene.second_gripper is None else self._second_rows(self.second_gripper)),
            ("time", f"{self.seconds:.2f} s"),
        ]

    @staticmethod
    def _second_rows(second: SecondAlongX | None) -> Rows:
        if second is None:
            return [("2nd gripper", "none is needed: the strip does not snap")]
        taken = f"at lambda = {second.advance:.6g} m, x = {second.x:.4g} m, z = {second.z:.4g} m"
        return [
            ("2nd gripper", metres(second.s, f"along the strip from the first, taken {taken}")),
            ("  snap", f"{'yes' if second.snap else 'no'}: {second.reason}"),
            ("  lambda", metres(second.end, f"stable up to there, {second.gain:.4g} m more than with one gripper")),
        ]

    @staticmethod
    def _range_rows(ends: EtaBRange) -> Rows:
        rows = []
        for eta_b, snaps, advance, margin in zip(ends.eta_b, ends.snap, ends.advance, ends.margin, strict=True):
            side = f"{abs(margin):.4g} m {'above' if margin > 0.0 else 'below'} the touch limit"
            rows.append((f"eta_b {eta_b:.4g}", f"{'snap' if snaps else 'touch'} at {advance:.6g} m, gripper {side}"))
        return rows

    def to_dict(self) -> dict[str, Any]:
        names: tuple[str, ...] = (
            "lambda_c",
            "x_c",
            "error",
            "free_length",
            "snap",
            "reason",
            "seconds",
            "lambda_c_lower",
        )
        names += ("lambda_c_upper", "lambda_touch", "touch_x", "lambda_0", "model", "model_error", "solid_error")
        asked = {"eta_b_range": self.eta_b_range, "second_gripper": self.second_gripper}
        numbers: dict[str, Any] = {name: getattr(self, name) for name in names}
        return numbers | {name: asdict(found) for name, found in asked.items() if found is not None}

    def to_dataset(self) -> xr.Dataset:
        names: tuple[str, ...] = (
            "lambda_c",
            "lambda_c_lower",
            "lambda_c_upper",
            "lambda_touch",
            "touch_x",
            "error",
            "lambda_0",
        )
        names += ("model_error", "solid_error", "free_length")
        values: dict[str, Any] = {name: ((), getattr(self, name)) for name in names}
        values |= {"x": ("node", self.state[:, 0]), "z": ("node", self.state[:, 1])}
        if (ends := self.eta_b_range) is not None:
            values |= {"end_eta_b": ("end", ends.eta_b), "end_snap": ("end", np.array(ends.snap, dtype=float))}
            values |= {"end_advance": ("end", ends.advance), "end_margin": ("end", ends.margin)}
        if (second := self.second_gripper) is not None:
            values |= {f"second_{key}": ((), float(item)) for key, item in asdict(second).items() if key != "reason"}
        values["gripper_height"] = ((), self.scene.height)
        attrs = {"model": self.model, "snap": int(self.snap), "reason": self.reason}
        return schema.dataset(values, attrs)

    def plot(self) -> Figure:
        """The strip where the advance ends."""
        from stripfold.draw.results import draw_strip

        return draw_strip([self.state])

    def config(self) -> dict[str, Any]:
        return self.scene.model_dump()


def find(scene: Scene, progress: Progress | None = None, prediction: ElasticaPrediction | None = None) -> CriticalPoint:
    """Find the critical point of a scene to its accuracy.

    With the model "auto" the cheapest model is used whose lambda_c is within the accuracy of the solid's; otherwise the
    accuracy is that of the given model.  ``prediction`` is the elastica's at this height, if it is known already.

    Raises SolveError: when it cannot be computed, or not to the accuracy asked for.
    """
    began, say = perf_counter(), progress or (lambda _: None)
    prediction = prediction or ElasticaPrediction.at(scene.height_star)
    if scene.model == "auto":
        found, used = _auto(scene, prediction, say)
    else:
        found, used = _find(scene, prediction, say), scene
    reason = found.end.reason
    if found.end is End.LIFTED and used.model == "solid" and prediction.end(scene.length_star) is not End.LIFTED:
        # Where less lies than the strip is thick, the solid's lift-off has no place on the strip any more.
        rod = used.model_copy(update={"model": "rod", "law": "svk"})
        by_rod = _find(rod, prediction, say)
        if by_rod.end is not End.LIFTED:
            found, used, reason = by_rod, rod, f"{by_rod.end.reason}; {BY_ROD}"
    unit, material = scene.material.gravity_length, scene.material
    advance = unit * (found.lambda_c if found.end is End.SNAP else found.lambda_touch)
    printed = nan if scene.law == "printed" else 1.0
    snaps = found.end is End.SNAP
    place, uncertainty = scene.second_gripper, scene.eta_b_uncertainty
    lengths = {name: unit * value for name, value in found._asdict().items() if name != "end"}
    return CriticalPoint(
        **lengths,
        x_c=lengths["lambda_c"] - 0.5 * scene.length,
        snap=snaps,
        reason=reason,
        seconds=perf_counter() - began,
        model=used.model,
        model_error=advance * used.distance_from_solid(used.model),
        solid_error=printed * advance * solid_error(material.relative_thickness, material.nu, scene.height_star),
        eta_b_range=None if uncertainty is None else over_eta_b(scene, uncertainty, advance),
        second_gripper=second_gripper(scene, place) if place is not None and snaps else None,
        scene=scene,
    )


def over_eta_b(scene: Scene, uncertainty: float, advance: float) -> EtaBRange:
    """The range for eta_b times 1 - ``uncertainty`` and 1 + ``uncertainty``.

    ``scene``, ``advance``: the strip and its gripper, and the end of its advance with the given eta_b.  Raises
    InvalidInputError: with one of them this is no strip, or it is too short or the gripper too high or low for one;
    SolveError: the elastica could not be solved.
    """
    ends = [scene.with_eta_b((1.0 + sign * uncertainty) * scene.eta_b) for sign in (-1.0, 1.0)]
    for end in ends:
        end.require_long_enough()
    units = [end.gravity_length for end in ends]
    given, *found = (elastica.critical(end.height_star) for end in (scene, *ends))
    off = advance - scene.gravity_length * given.state.advance
    low, high = (off + unit * point.state.advance for unit, point in zip(units, found, strict=True))
    limits = [scene.height - unit * elastica.touch_limit() for unit in units]
    return EtaBRange(
        (ends[0].eta_b, ends[1].eta_b), (found[0].snap, found[1].snap), (low, high), (limits[0], limits[1])
    )


class _Found(NamedTuple):
    """The end of an advance, in L*; nan: lambda_c and its bracket without a snap, lambda_touch with one."""

    end: End
    lambda_0: float
    free_length: float
    state: Array
    lambda_c: float = nan
    lambda_c_lower: float = nan
    lambda_c_upper: float = nan
    lambda_touch: float = nan
    touch_x: float = nan
    error: float = nan


def _auto(scene: Scene, prediction: ElasticaPrediction, progress: Progress) -> tuple[_Found, Scene]:
    """The end of the advance by the cheapest model that succeeds, and the scene with that model."""
    thickness, nu = scene.material.relative_thickness, scene.material.nu
    models = select_model.candidates(prediction, scene.length_star, thickness, nu, scene.accuracy)
    for model in models:
        left = scene.model_copy(update={"model": model})
        left = left.model_copy(update={"accuracy": scene.accuracy - left.distance_from_solid(model)})
        try:
            return _find(left, prediction, progress), left
        except SolveError as error:
            # Such as a rod that is too thick for its low gripper.
            if model == models[-1]:
                raise
            progress(f"not by the {model}: {error}")
    raise AssertionError("the last model returns or raises")


def _find(scene: Scene, prediction: ElasticaPrediction, progress: Progress) -> _Found:
    """The end of the advance by the scene's model."""
    progress(f"model {scene.model}")
    first, last = prediction.first, prediction.last
    length, thickness = scene.length_star, scene.material.relative_thickness
    end = prediction.end(length)
    too_long = last.length - length
    if end is End.LIFTED and (scene.model == "elastica" or too_long > select_model.room_for(thickness)):
        return _Found(end, first.advance, last.length, np.empty((0, 2)))
    if scene.model == "elastica":
        state = _mid_surface(last, length)
        if end is End.TOUCH:
            assert last.sag is not None
            x = last.length - length / 2.0 - float(last.at(last.sag.s).x)
            return _Found(
                end, first.advance, last.length, state, lambda_touch=last.advance, touch_x=x, error=ELASTICA_ERROR
            )
        bracket = last.advance - ELASTICA_ERROR, last.advance + ELASTICA_ERROR
        return _Found(End.SNAP, first.advance, last.length, state, last.advance, *bracket, error=ELASTICA_ERROR)
    nu, law = (scene.material.nu, scene.law) if scene.model == "solid" else (0.0, "svk")
    strip = StripModel(length, thickness, nu, law=law, kind=scene.model)
    tolerance = max(LAMBDA_TOLERANCE, BRACKET * scene.accuracy * last.advance)
    run, error = _fine_enough(scene, strip, prediction, tolerance, progress)
    state = run.last.problem.mid_surface(run.last.point.q)
    lambda_0 = without_horizontal_force(strip, prediction, select_model.refinement(scene.model, scene.accuracy))
    if run.end is End.TOUCH:
        _, place = clearance(run.last.problem, run.last.point.q)
        x = float(run.last.mid_surface(np.array([place]))[0, 0])
        return _Found(run.end, lambda_0, run.free_length, state, lambda_touch=run.lam, touch_x=x, error=error)
    if run.critical is None:
        return _Found(run.end, lambda_0, run.free_length, state)
    bracket = run.critical.lower, run.critical.upper
    return _Found(run.end, lambda_0, run.free_length, state, run.lam, *bracket, error=error)


def _run(
    strip: StripModel, prediction: ElasticaPrediction, refinement: float, tolerance: float, progress: Progress
) -> Snap | Track:
    """The end of the advance, from the elastica's or, where a strip is so thick that none is near, from flat."""
    progress(f"elements {refinement:.2g} times the standard ones")
    with suppress(SolveError):
        return snap(strip, prediction, refinement)
    return _followed(strip, prediction, refinement, tolerance, progress)


def _followed(
    strip: StripModel, prediction: ElasticaPrediction, refinement: float, tolerance: float, progress: Progress
) -> Track:
    """The end of the advance, the branch followed to it."""
    try:
        return from_near_the_end(strip, prediction, refinement, tolerance)
    except SolveError as error:
        progress(f"followed from the flat strip: {error}")
        return solve_height(strip, prediction.height, refinement)


def _mid_surface(state: elastica.State, length: float) -> Array:
    """Mid-surface of a state of the elastica from the grasped end on, shape (n, 2), L*."""
    at = state.at(np.linspace(state.length, 0.0, POINTS))
    return np.vstack([np.column_stack([state.length - length / 2.0 - at.x, at.z]), [length / 2.0, 0.0]])


def _fine_enough(
    scene: Scene, strip: StripModel, prediction: ElasticaPrediction, tolerance: float, progress: Progress
) -> tuple[Track, float]:
    """The run on the first mesh within the scene's accuracy, and its error, L*."""
    refinement = select_model.refinement(scene.model, scene.accuracy)
    coarse: Snap | Track = _run(strip, prediction, select_model.COARSER * refinement, tolerance, progress)
    while True:
        end = _run(strip, prediction, refinement, tolerance, progress)
        try:
            fine = end.checked(tolerance) if isinstance(end, Snap) else end
        except SolveError as refused:
            progress(f"not the first limit point: {refused}")
            fine = _followed(strip, prediction, refinement, tolerance, progress)
        error = select_model.error(scene.model, refinement, fine.lam, coarse.lam, fine.slack)
        if fine.end is coarse.end and error <= scene.accuracy * fine.lam:
            return fine, error
        if refinement / select_model.COARSER < select_model.FINEST:
            raise SolveError(
                f"the error of lambda_c is {error / fine.lam:.1e}, allowed {scene.accuracy:.1e}",
                advice="ask for less accuracy",
            )
        refinement /= select_model.COARSER
        coarse = fine
