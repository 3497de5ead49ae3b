"""The critical point of a strip whose gripper advances at constant height: found to an accuracy, in SI."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields
from math import nan
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stripfold import elastica
from stripfold.ask import select_model
from stripfold.ask.inputs import Scene
from stripfold.ask.prediction import ElasticaPrediction, Snap, end_of_advance, unchecked_end, without_horizontal_force
from stripfold.ask.second_gripper import SecondAlongX, second_gripper
from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.files import schema
from stripfold.files.reporting import Progress, Result, Rows, metres
from stripfold.follow.contact_branch import clearance
from stripfold.follow.statics import LAMBDA_TOLERANCE, StripModel
from stripfold.follow.track import End, Track

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

ELASTICA_ERROR = 1e-9
"""Error of the elastica's lambda_c, L*, held by its tests."""
POINTS = 200
"""Points of the elastica's mid-surface."""
BY_ROD = "computed with the rod: too little of the strip is left on the floor for the solid"
NOT_HELD: Rows = [("2nd gripper", "none is needed: the strip does not snap")]
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

    def rows(self) -> Rows:
        """The two ends in words."""
        rows = []
        for eta_b, snaps, advance, margin in zip(self.eta_b, self.snap, self.advance, self.margin, strict=True):
            side = f"{abs(margin):.4g} m {'above' if margin > 0.0 else 'below'} the touch limit"
            rows.append((f"eta_b {eta_b:.4g}", f"{'snap' if snaps else 'touch'} at {advance:.6g} m, gripper {side}"))
        return rows


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
        Shape (n, 2): x and z of the mid-surface where the advance ends, from the gripped end.
    eta_b_range
        The ends of the advance for an uncertain eta_b; None where no uncertainty is given.
    second_gripper
        What a second gripper gains; None where none is asked for or the strip does not snap.
    scene
        The inputs.
    """

    lambda_c: float
    x_c: float
    error: float
    free_length: float
    snap: bool
    reason: str
    seconds: float
    lambda_c_lower: float
    lambda_c_upper: float
    lambda_touch: float
    touch_x: float
    lambda_0: float
    model: str
    model_error: float
    solid_error: float
    eta_b_range: EtaBRange | None
    second_gripper: SecondAlongX | None
    state: Array = field(repr=False)
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
            *(ends.rows() if ends else []),
            *([] if scene.second_gripper is None else self.second_gripper.rows() if self.second_gripper else NOT_HELD),
            ("time", f"{self.seconds:.2f} s"),
        ]

    def to_dict(self) -> dict[str, Any]:
        numbers = {item.name: getattr(self, item.name) for item in fields(self) if item.name not in ("state", "scene")}
        for name in ("eta_b_range", "second_gripper"):
            if (found := numbers.pop(name)) is not None:
                numbers[name] = asdict(found)
        return numbers

    def to_dataset(self) -> xr.Dataset:
        stored = {name: value for name, value in self.to_dict().items() if name not in ("x_c", "seconds")}
        values: dict[str, Any] = {name: ((), value) for name, value in stored.items() if isinstance(value, float)}
        values |= {"x": ("node", self.state[:, 0]), "z": ("node", self.state[:, 1])}
        for name, numbers in asdict(self.eta_b_range).items() if self.eta_b_range else ():
            values[f"end_{name}"] = ("end", np.array(numbers, dtype=float))
        for name, number in asdict(self.second_gripper).items() if self.second_gripper else ():
            if name != "reason":
                values[f"second_{name}"] = ((), float(number))
        values["gripper_height"] = ((), self.scene.height)
        return schema.dataset(values, {"model": self.model, "snap": int(self.snap), "reason": self.reason})

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

    Raises InvalidInputError: the strip is too short for this height; SolveError: the critical point cannot be computed,
    or not to the accuracy asked for.
    """
    began, say = perf_counter(), progress or (lambda _: None)
    prediction = prediction or ElasticaPrediction.at(scene.height_star)
    scene.require_long_enough(prediction.last.length)
    found, used = _by_cheapest(scene, prediction, say)
    reason = found.end.reason
    if found.end is End.LIFTED and used.model == "solid":
        # Where less lies than the strip is thick, the solid's lift-off has no place on the strip any more.
        rod = used.model_copy(update={"model": "rod"})
        by_rod = _find(rod, prediction, say)
        if by_rod.end is not End.LIFTED:
            found, used, reason = by_rod, rod, f"{by_rod.end.reason}; {BY_ROD}"
    unit, material, snaps = scene.gravity_length, scene.material, found.end is End.SNAP
    advance = unit * (found.lambda_c if snaps else found.lambda_touch)
    solid = select_model.solid_error(material.relative_thickness, material.nu, scene.height_star)
    place, uncertainty = scene.second_gripper, scene.eta_b_uncertainty
    lengths = {name: unit * value for name, value in found._asdict().items() if name != "end"}
    return CriticalPoint(
        **lengths,
        x_c=lengths["lambda_c"] - 0.5 * scene.length,
        snap=snaps,
        reason=reason,
        seconds=perf_counter() - began,
        model=used.model,
        model_error=advance * used.distance_from_solid(used.model) if scene.plain else nan,
        solid_error=advance * solid if scene.plain and scene.law == "svk" else nan,
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
    given = scene.model_dump()
    ends = [Scene(**given | {"eta_b": (1.0 + sign * uncertainty) * scene.eta_b}) for sign in (-1.0, 1.0)]
    for end in ends:
        end.require_long_enough()
    units = [end.gravity_length for end in ends]
    here, *found = (elastica.critical(end.height_star) for end in (scene, *ends))
    off = advance - scene.gravity_length * here.state.advance
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


def _by_cheapest(scene: Scene, prediction: ElasticaPrediction, say: Progress) -> tuple[_Found, Scene]:
    """The end of the advance by the scene's model, or the cheapest that succeeds, and the scene with that model."""
    if scene.model != "auto":
        return _find(scene, prediction, say), scene
    thickness, nu = scene.material.relative_thickness, scene.material.nu
    for model in select_model.candidates(prediction, scene.length_star, thickness, nu, scene.accuracy):
        left = scene.accuracy - scene.distance_from_solid(model)
        used = scene.model_copy(update={"model": model, "accuracy": left})
        try:
            return _find(used, prediction, say), used
        except SolveError as error:
            # Such as a rod that is too thick for its low gripper.
            refused = error
            say(f"not by the {model}: {error}")
    raise refused


def _find(scene: Scene, prediction: ElasticaPrediction, progress: Progress) -> _Found:
    """The end of the advance by the scene's model."""
    progress(f"model {scene.model}")
    length, accuracy = scene.length_star, scene.accuracy
    if scene.model == "elastica":
        return _of_elastica(prediction, length)
    thickness, curl = scene.material.relative_thickness, scene.curl_star
    strip = StripModel(length, thickness, scene.nu, law=scene.law, kind=scene.model, curl=curl)
    tolerance = max(LAMBDA_TOLERANCE, BRACKET * accuracy * prediction.last.advance)
    run, error = _fine_enough(scene, strip, prediction, tolerance, progress)
    at, critical = run.last, run.critical
    lambda_0 = without_horizontal_force(strip, prediction, select_model.refinement(scene.model, accuracy))
    found = _Found(run.end, lambda_0, run.free_length, at.problem.mid_surface(at.point.q), error=error)
    if run.end is End.TOUCH:
        _, place = clearance(at.problem, at.point.q)
        return found._replace(lambda_touch=run.lam, touch_x=float(at.mid_surface(np.array([place]))[0, 0]))
    if critical is None:
        return found._replace(error=nan)
    return found._replace(lambda_c=run.lam, lambda_c_lower=critical.lower, lambda_c_upper=critical.upper)


def _of_elastica(prediction: ElasticaPrediction, length: float) -> _Found:
    """The end of the advance by the elastica."""
    last, advance = prediction.last, prediction.last.advance
    # From the grasped end on; its own x counts from the lift-off.
    at, origin = last.at(np.linspace(last.length, 0.0, POINTS)), last.length - length / 2.0
    state = np.vstack([np.column_stack([origin - at.x, at.z]), [length / 2.0, 0.0]])
    end = End.SNAP if prediction.snap else End.TOUCH
    found = _Found(end, prediction.first.advance, last.length, state, error=ELASTICA_ERROR)
    if last.sag is not None and end is End.TOUCH:
        return found._replace(lambda_touch=advance, touch_x=origin - float(last.at(last.sag.s).x))
    bracket = advance - ELASTICA_ERROR, advance + ELASTICA_ERROR
    return found._replace(lambda_c=advance, lambda_c_lower=bracket[0], lambda_c_upper=bracket[1])


def _fine_enough(
    scene: Scene, strip: StripModel, prediction: ElasticaPrediction, tolerance: float, progress: Progress
) -> tuple[Track, float]:
    """The run on the first mesh within the scene's accuracy, and its error, L*."""
    refinement = select_model.refinement(scene.model, scene.accuracy)
    coarse: Snap | Track = unchecked_end(
        strip, prediction, select_model.COARSER * refinement, tolerance, progress, scene.clamp_angle
    )
    while True:
        fine = end_of_advance(strip, prediction, refinement, tolerance, progress, scene.clamp_angle)
        error = select_model.error(scene.model, refinement, fine.lam, coarse.lam, fine.slack)
        if fine.end is coarse.end and error <= scene.accuracy * fine.lam:
            return fine, error
        refinement /= select_model.COARSER
        if refinement < select_model.FINEST:
            raise SolveError(
                f"the error of lambda_c is {error / fine.lam:.1e}, allowed {scene.accuracy:.1e}",
                advice="ask for less accuracy",
            )
        coarse = fine
