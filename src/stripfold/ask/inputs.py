"""Inputs about a strip, validated once; names, units, limits and help texts have their source here.

All numbers in SI; what goes together is checked in L*, where the limits are much sharper.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cached_property
from math import radians, sqrt
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from stripfold.ask.select_model import model_error
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import GRAVITY, Material
from stripfold.base.validation import (
    ETA_B,
    HEIGHT_STAR,
    Accuracy,
    Air,
    EtaB,
    EtaM,
    Flag,
    Gravity,
    Gripper,
    Height,
    Input,
    Length,
    MovingModel,
    Nu,
    Number,
    RhoA,
    Stiffness,
    Text,
    quantity,
    read_yaml,
    value_meant,
)

LENGTH_STAR = (3.0, 150.0)
"""Allowed strip lengths, L*.  The shortest strip that can snap is twice as long; the longest is a matter of cost."""
MAX_THICKNESS_STAR = 0.2
"""Largest thickness of the model, L*: at 0.3 the solid's lambda_c depends on the mesh (docs/hard-cases.md)."""
LARGEST_PUSH, MAX_COMPRESSION = 2.75, 0.9
"""Largest push of a low gripper times its height squared, in L*, and largest compression of the strip by it over its
height: from there on the strip snaps at that push, where the force on one node decides (docs/hard-cases.md)."""
MAX_MU = 5.0
"""Largest coefficient of friction; those of fabrics on fabrics are 0.2 to 1."""
MOST_UNCERTAIN = 0.5
"""Largest relative uncertainty of eta_b that a plan takes."""
UNSTRETCHED = 1e-6
"""eta_m, m^-2 s^2, of a strip that hardly stretches: any strip with it is thin."""

THIN_SOLID = 0.01
"""Thickness, L*, below which a moving strip is a rod unless the solid is asked for: the solid's elements err by more
than its thickness does, and may lead to the other side of a bifurcation."""

Model = Literal["solid", "rod", "elastica", "auto"]
Law = Literal["svk", "printed"]


class Strip(Input):
    """A strip of fabric: each number within its limits, and a combination that is a strip."""

    length: Length
    eta_b: EtaB
    eta_m: EtaM = 1e-3
    nu: Nu = 0.0
    rho_a: RhoA = 1.0
    gravity: Gravity = GRAVITY

    @cached_property
    def material(self) -> Material:
        """The strip's material."""
        return Material(self.eta_b, self.eta_m, self.nu, self.rho_a, self.gravity)

    @property
    def gravity_length(self) -> float:
        """L*, m."""
        return self.material.gravity_length

    @property
    def length_star(self) -> float:
        """Length of the strip, L*."""
        return self.length / self.gravity_length

    @property
    def usual_model(self) -> MovingModel:
        """The model of the strip in motion, unless another is asked for."""
        return "rod" if self.material.relative_thickness < THIN_SOLID else "solid"

    @model_validator(mode="after")
    def _check(self) -> Self:
        self._check_strip()
        return self

    def _check_strip(self) -> None:
        star = self.gravity_length
        low, high = LENGTH_STAR
        if not low <= self.length_star <= high:
            # eta_b = 1 / (g L*^3), for the L* that would make this length allowed.
            stiffest, softest = (1.0 / (self.gravity * (self.length / n) ** 3) for n in (low, high))
            lowest, highest = max(stiffest, ETA_B[0]), min(softest, ETA_B[1])
            fitting = f"; eta_b from {lowest:.3g} to {highest:.3g} fits this length" if lowest < highest else ""
            advice = value_meant(self.length, "m", low * star, high * star) or _CHECK_UNITS + fitting
            raise InvalidInputError("length", self.length, self._range(low, high), advice)
        if not self.material.relative_thickness <= MAX_THICKNESS_STAR:
            # h / L* = sqrt(12 eta_m / eta_b) / L*
            thickest = MAX_THICKNESS_STAR * star
            largest = thickest**2 * self.eta_b / 12.0
            raise InvalidInputError(
                "eta_m",
                self.eta_m,
                f"at most {largest:.3g} m^-2 s^2 with eta_b = {self.eta_b:g} m^-4 s^2",
                f"the model would be {self.material.thickness:.3g} m thick, more than {thickest:.3g} m",
            )

    def _range(self, low: float, high: float) -> str:
        star = self.gravity_length
        return (
            f"from {low * star:.3g} to {high * star:.3g} m with eta_b = {self.eta_b:g} m^-4 s^2 "
            f"({low:g} to {high:g} times L* = {star:.3g} m)"
        )


_CHECK_UNITS = "check the units, m and m^-4 s^2"


class AtHeight(Strip):
    """A strip and the height of its gripper."""

    height: Height
    accuracy: Accuracy = 1e-3

    @property
    def height_star(self) -> float:
        """Height of the gripper, L*."""
        return self.height / self.gravity_length

    def distance_from_solid(self, model: str) -> float:
        """Bound of a model's relative distance from the solid's lambda_c."""
        material = self.material
        return model_error(model, material.relative_thickness, material.nu, self.height_star, self.length_star)

    def _check_strip(self) -> None:
        (low, high), star = HEIGHT_STAR, self.gravity_length
        above = self.height >= self.length
        if above and low <= self.length_star <= high and LENGTH_STAR[0] <= self.height_star <= LENGTH_STAR[1]:
            allowed = f"less than the length, {self.length:g} m"
            raise InvalidInputError("height", self.height, allowed, "height above the length: are the two swapped?")
        super()._check_strip()
        meant = value_meant(self.height, "m", low * star, min(high * star, self.length))
        if above:
            allowed = f"less than the length, {self.length:g} m"
            raise InvalidInputError("height", self.height, allowed, meant or "height above the length")
        if not low <= self.height_star <= high:
            raise InvalidInputError("height", self.height, self._range(low, high), meant or _CHECK_UNITS)
        thickness = self.material.relative_thickness
        lowest = (LARGEST_PUSH * self.length_star * thickness**2 / (12.0 * MAX_COMPRESSION)) ** (1.0 / 3.0)
        if self.height_star < lowest:
            largest = self.eta_m * (self.height_star / lowest) ** 3
            raise InvalidInputError(
                "height",
                self.height,
                f"at least {lowest * star:.3g} m with eta_m = {self.eta_m:g} m^-2 s^2",
                f"so low a gripper compresses the strip until it snaps: go higher, or give eta_m <= {largest:.2g}",
            )

    def require_long_enough(self, lifted: float | None = None) -> None:
        """Refuse a strip of which nothing would lie on the floor any more where the advance of the gripper ends.

        ``lifted``: free length there, the elastica's, L*, if it is known already.  Raises InvalidInputError: the strip
        is too short for this height; SolveError: the elastica could not be solved.
        """
        from stripfold import elastica

        lifted = elastica.critical(self.height_star).state.length if lifted is None else lifted
        shortest = lifted * self.gravity_length
        if not self.length > shortest:
            raise InvalidInputError(
                "length",
                self.length,
                f"more than {shortest:.4g} m with height = {self.height:g} m",
                "the strip is too short: all of it would leave the floor before it snaps; lengthen it or go lower",
            )


SecondPlace = Annotated[
    Number | Literal["auto"] | None,
    quantity("place along the strip that a second gripper holds; auto: where the critical mode moves most", "m"),
]

FrictionMoment = Annotated[
    Number | None, quantity("M_0 of the fabric's bending hysteresis, per width", "N", gt=0.0, le=1e3)
]


Flatness = Annotated[
    Number,
    quantity(
        "height of the wrinkles that may be in the flat strip: the push must not make them grow", "m", ge=0.0, le=0.1
    ),
]
FLATNESS = 5e-4
"""Usual height of wrinkles, m: half a millimetre over 5 cm."""


MAX_CURL = 0.5
"""Largest curl of a strip, 1/L*: more lifts what lies far beside the ends."""


class Curled(Strip):
    """A strip that may be curled."""

    curl: Annotated[
        Number,
        quantity("curvature of the strip without forces; positive where the ends of what lies would curl up", "1/m"),
    ] = 0.0

    @property
    def curl_star(self) -> float:
        """The curl, 1/L*."""
        return self.curl * self.gravity_length

    @model_validator(mode="after")
    def _check_curl(self) -> Self:
        largest = MAX_CURL / self.gravity_length
        if not abs(self.curl) <= largest:
            allowed = f"from {-largest:.3g} to {largest:.3g} 1/m, {MAX_CURL:g} / L*"
            raise InvalidInputError("curl", self.curl, allowed, "one over the radius of the curled strip, m")
        return self


class Held(AtHeight, Curled):
    """The same with a gripper that may clamp the strip, which may be curled."""

    clamp: Annotated[
        Number | None,
        quantity(
            "angle at which the gripper clamps the strip, 0 as it grasps the flat strip; a hinge if left out",
            "degree",
            ge=-90.0,
            le=180.0,
        ),
    ] = None

    @property
    def clamp_angle(self) -> float | None:
        """The clamp's angle, rad."""
        return None if self.clamp is None else radians(self.clamp)


class Scene(Held):
    """A strip and a gripper height, for a critical point.

    Examples
    --------
    >>> scene = Scene(length=0.6, height=0.09, eta_b=3780.0)
    >>> round(scene.length_star, 3), round(scene.height_star, 3)
    (20.008, 3.001)
    """

    model: Annotated[
        Model,
        Field(
            description="the paper's finite elements, a rod (several times as fast), the thin limit, or the cheapest "
            "of them within the requested accuracy of the first"
        ),
    ] = "solid"
    law: Annotated[Law, Field(description="constitutive law of the solid (docs/physics.md, section 2)")] = "svk"
    eta_b_uncertainty: Annotated[
        Number | None, quantity("relative uncertainty of eta_b, as 0.2 or 20%: the range of the result", ge=0.0, le=0.9)
    ] = None
    second_gripper: SecondPlace = None

    @model_validator(mode="after")
    def _check_plain(self) -> Self:
        if not self.plain:
            special = "curl" if self.clamp is None else "clamp"
            if self.model in ("elastica", "auto"):
                raise InvalidInputError("model", self.model, f"solid or rod together with {special}")
            for name in ("eta_b_uncertainty", "second_gripper"):
                if getattr(self, name) is not None:
                    raise InvalidInputError(special, getattr(self, special), f"no {special} together with {name}")
        return self

    @property
    def plain(self) -> bool:
        """Whether the strip is the paper's, as the bounds of the errors know it: in a hinge and not curled."""
        return self.clamp is None and not self.curl

    @model_validator(mode="after")
    def _check_law(self) -> Self:
        if self.curl and self.law != "svk":
            raise InvalidInputError("law", self.law, "svk together with curl")
        if self.model != "solid" and self.law != "svk":
            raise InvalidInputError("law", self.law, "svk", "only the solid has another law")
        return self


TableFriction = Annotated[
    Number | None,
    quantity(
        "coefficient of friction of the table that alone holds what lies; by default its end is pinned",
        ge=0.0,
        le=MAX_MU,
    ),
]


class PathInputs(Curled):
    """A strip to be moved along a path, its model, its falls and its friction."""

    model: Annotated[
        MovingModel | None,
        Field(description=f"the paper's finite elements, or a rod, the default below {THIN_SOLID:g} L* of thickness"),
    ] = None
    fall: Annotated[Flag, Field(description="simulate the fall at a critical point, and go on after it")] = False
    friction_moment: Annotated[
        Number | None, quantity("M_0 of the fabric's bending hysteresis, per width", "N", ge=0.0, le=1e3)
    ] = None
    pull: Annotated[Number | None, quantity("k_f of the paper's internal friction", "s^-2", ge=0.0, le=1e9)] = None
    layer_friction: Annotated[
        Number | None,
        quantity("coefficient of friction between the layers and on the floor; followed in time", ge=0.0, le=MAX_MU),
    ] = None
    speed: Annotated[
        Annotated[Number, Field(ge=1e-4, le=10.0)] | Literal["table"] | None,
        quantity(
            "speed of the gripper in time, or table: that of the path's own times, s; by default 0.2 sqrt(g L*)",
            "m s^-1",
        ),
    ] = None
    step: Annotated[Number | None, quantity("step size with friction; by default 0.1 L*", "m", ge=1e-9, le=1e6)] = None

    second_gripper: SecondPlace = None
    gripper: Annotated[
        Gripper,
        Field(
            description="how it holds the strip: as a hinge, or clamped and fixed as it grasped the flat strip, or "
            "turning as the path says"
        ),
    ] = "hinge"
    flatness: Flatness = FLATNESS
    table_friction: TableFriction = None
    bending_test: Annotated[
        Text | None,
        Field(description="table curvature,moment of a bending test, 1/m and N, and unloading if known: its own law"),
    ] = None

    @property
    def kind(self) -> MovingModel:
        """The model, or the usual one."""
        return self.model or self.usual_model

    @model_validator(mode="after")
    def _check_law(self) -> Self:
        if self.bending_test is not None:
            for name in ("fall", "pull", "layer_friction", "second_gripper", "table_friction", "curl"):
                if getattr(self, name):
                    raise InvalidInputError("bending_test", self.bending_test, f"nothing together with {name}")
            if self.gripper != "hinge":
                raise InvalidInputError("gripper", self.gripper, "hinge together with bending_test")
        return self

    @model_validator(mode="after")
    def _check_second(self) -> Self:
        if self.curl and self.second_gripper is not None:
            raise InvalidInputError("curl", self.curl, "no curl together with second_gripper")
        return self

    @model_validator(mode="after")
    def _check_table(self) -> Self:
        for name in ("layer_friction", "second_gripper"):
            if self.table_friction is not None and getattr(self, name) is not None:
                advice = "with it the end is pinned"
                raise InvalidInputError("table_friction", self.table_friction, f"nothing together with {name}", advice)
        return self

    @model_validator(mode="after")
    def _check_gripper(self) -> Self:
        if self.gripper != "hinge":
            for name in ("layer_friction", "second_gripper"):
                if getattr(self, name) is not None:
                    allowed = f"hinge together with {name}"
                    advice = "a clamp is there in statics and falls only"
                    raise InvalidInputError("gripper", self.gripper, allowed, advice)
        return self

    @model_validator(mode="after")
    def _check_friction(self) -> Self:
        laws = self.friction_moment, self.pull, self.layer_friction
        if self.second_gripper is not None and any(law is not None for law in laws):
            raise InvalidInputError("second_gripper", self.second_gripper, "no friction together with it")
        if self.friction_moment is not None and self.pull is not None:
            raise InvalidInputError("pull", self.pull, "nothing together with friction_moment", "give only one")
        internal = self.friction_moment is not None or self.pull is not None
        if self.fall and internal:
            raise InvalidInputError("fall", self.fall, "no fall together with friction_moment or pull")
        if self.layer_friction is not None and (self.fall or self.pull is not None):
            advice = "with it a path is followed in time: falls are part of it, and the pull is not defined there"
            raise InvalidInputError("layer_friction", self.layer_friction, "neither fall nor pull with it", advice)
        if self.speed is not None and self.layer_friction is None:
            allowed = "a speed together with layer_friction, with which a path is followed in time"
            raise InvalidInputError("speed", self.speed, allowed)
        if self.step is not None and not internal and self.bending_test is None:
            raise InvalidInputError("step", self.step, "a step together with friction_moment, pull or bending_test")
        return self


class MapInputs(Strip):
    """A strip whose gripper's places are mapped, and its friction."""

    friction_moment: FrictionMoment = None


class PlanInputs(Curled):
    """A strip to be folded, how well it is known, and what the robot may do."""

    eta_b_uncertainty: Annotated[
        Number, quantity("relative uncertainty of eta_b, as 0.2 or 20%", ge=0.0, le=MOST_UNCERTAIN)
    ] = 0.2
    goal: Annotated[
        Literal["accurate", "gentle", "quick"], Field(description="what makes a path better than another")
    ] = "accurate"
    gripper_accuracy: Annotated[
        Number,
        quantity("distance within which the gripper is where it should be, 95 times of 100", "m", ge=0.0, le=0.1),
    ] = 1e-3
    layer_friction: Annotated[
        Number, quantity("largest coefficient of friction between the layers and on the floor", ge=0.0, le=MAX_MU)
    ] = 0.5
    max_snap: Annotated[Number | None, quantity("limit: height by which the strip may snap down", "m", ge=0.0)] = None
    max_slide: Annotated[
        Number | None, quantity("limit: way of the upper layer over the lower one, once they touch", "m", ge=0.0)
    ] = None
    margin: Annotated[
        Number | None,
        quantity("limit: distance of the gripper from where the strip snaps, for every eta_b", "m", ge=0.0, le=1e6),
    ] = None
    tool: Annotated[
        Number | None,
        quantity("limit: length of a tool behind the grasp, which must stay above the table", "m", ge=0.0, le=10.0),
    ] = None
    friction_moment: FrictionMoment = None
    friction_uncertainty: Annotated[
        Number | None,
        quantity("relative uncertainty of M_0, as 0.2 or 20%; by default a tenth", ge=0.0, le=MOST_UNCERTAIN),
    ] = None
    yield_curvature: Annotated[
        Number | None, quantity("its kappa_y; by default 0.05 / L*, or M_0 over 4 B", "1/m", ge=1e-3, le=1e6)
    ] = None
    speed: Annotated[
        Number | None,
        quantity(
            "largest speed of the gripper, checked in time; 0.1 and unchecked if left out", "m s^-1", ge=1e-4, le=10.0
        ),
    ] = None
    acceleration: Annotated[Number, quantity("largest acceleration of it", "m s^-2", ge=1e-3, le=100.0)] = 0.5
    jerk: Annotated[Number | None, quantity("largest jerk of it along its path", "m s^-3", ge=1e-2, le=1e5)] = None
    flatness: Flatness = FLATNESS
    table_friction: TableFriction = None

    @model_validator(mode="after")
    def _check_plan(self) -> Self:
        if self.margin is not None and not self.margin < self.length:
            advice = value_meant(self.margin, "m", 0.0, 0.25 * self.length)
            raise InvalidInputError("margin", self.margin, f"less than the length, {self.length:g} m", advice)
        for name in ("yield_curvature", "friction_uncertainty"):
            if self.friction_moment is None and (value := getattr(self, name)) is not None:
                raise InvalidInputError(name, value, "this together with friction_moment")
        if self.yield_curvature is not None and self.friction_moment is not None:
            from stripfold.strip.effects import STIFFEST

            least = self.friction_moment * self.eta_b / (STIFFEST * self.rho_a)
            if self.yield_curvature < least * (1.0 - 1e-9):
                allowed = f"at least {least:.4g} 1/m, M_0 over {STIFFEST:g} B: a stiffer spring cannot be followed"
                raise InvalidInputError("yield_curvature", self.yield_curvature, allowed, "left out, it is that")
        for strip in self.strips:
            Curled(**strip.model_dump(), curl=self.curl)
        if self.curl and self.friction_moment is not None:
            raise InvalidInputError("curl", self.curl, "no curl together with friction_moment")
        return self

    @property
    def gripper_speed(self) -> float:
        """The speed, or the usual one, m/s."""
        return 0.1 if self.speed is None else self.speed

    @cached_property
    def strips(self) -> tuple[Strip, Strip, Strip]:
        """The strip with the least, the given and the largest eta_b: the stiffest first."""
        known = self.model_dump(include=set(Strip.model_fields) - {"eta_b"})
        factors = (1.0 - self.eta_b_uncertainty, 1.0, 1.0 + self.eta_b_uncertainty)
        stiffest, given, softest = (Strip(**known, eta_b=factor * self.eta_b) for factor in factors)
        return stiffest, given, softest


class Release(Input):
    """Release of the strip at its critical point, and damping of its fall.

    The default of ``air`` is the drag of air, about 0.3 kg m^-2 s^-1 at the 0.3 m/s of a falling layer, on a light
    fabric of 0.15 kg m^-2; that of ``stiffness`` a loss tangent of 0.1, usual for fabrics in bending, at the 5 Hz of a
    swinging layer.
    """

    disturbance: Annotated[
        Number,
        quantity(
            "largest initial speed of the mid-surface, along the critical eigenvector; positive: the way the branch "
            "continues",
            "m s^-1",
            ge=-1.0,
            le=1.0,
        ),
    ] = 1e-3
    speed: Annotated[Number, quantity("speed of the gripper; 0: held just past lambda_c", "m s^-1", ge=0.0, le=1.0)] = (
        0.0
    )
    air: Air = 2.0
    stiffness: Stiffness = 3e-3
    until: Annotated[Literal["rest", "touch"], Field(description="end of the fall")] = "rest"


def _on_or_off(value: Any) -> Any:
    # YAML takes on and off for true and false.
    return ("on" if value else "off") if isinstance(value, bool) else value


EffectSetting = Annotated[Literal["auto", "on", "off"], BeforeValidator(_on_or_off)]


class Effects(Input):
    """Effects of a simulation: "on", "off", or "auto", on where the scene needs it (docs/effects.md)."""

    contact: EffectSetting = "auto"
    self_contact: EffectSetting = "auto"
    inertia: EffectSetting = "auto"
    friction: EffectSetting = "auto"
    layer_friction: EffectSetting = "auto"
    solid: EffectSetting = "auto"

    @model_validator(mode="after")
    def _check_possible(self) -> Self:
        if self.contact == "off":
            advice = "the strip starts lying on the floor: without contact there is no state to start from"
            raise InvalidInputError("contact", "off", "auto or on", advice)
        return self


def _all_auto(value: Any) -> Any:
    if value == "auto":
        return Effects()
    if not isinstance(value, Mapping | Effects):
        raise InvalidInputError("", value, "auto, or keys and values as self_contact: off")
    return value


class Simulation(Held, Release):
    """A strip through its collapse: a scene, how the strip is released, and with which effects.

    The model is the usual one, or what ``model`` says; with ``effects`` and without ``model``, what those say or need.
    """

    model: Annotated[
        MovingModel,
        Field(description=f"the paper's finite elements, or a rod, the default below {THIN_SOLID:g} L* of thickness"),
    ] = "solid"
    layer_friction: Annotated[
        Number, quantity("coefficient of friction between the layers and on the floor", ge=0.0, le=MAX_MU)
    ] = 0.0
    friction_moment: Annotated[
        Number, quantity("M_0 of the fabric's bending hysteresis, per width", "N", ge=0.0, le=1e3)
    ] = 0.0
    effects: Annotated[Effects, BeforeValidator(_all_auto)] = Effects()

    @model_validator(mode="after")
    def _check_friction(self) -> Self:
        if self.effects.friction == "on" and not self.friction_moment:
            advice = "give the scene a friction_moment, N: half the height of the loop of a bending test"
            raise InvalidInputError("effects.friction", "on", "auto or off without one", advice)
        if self.friction_moment and self.clamp is not None:
            raise InvalidInputError("clamp", self.clamp, "no clamp together with friction_moment")
        return self

    @model_validator(mode="after")
    def _resolve_model(self) -> Self:
        given = self.model_fields_set
        solid = self.effects.solid
        if not given & {"model", "effects"}:
            object.__setattr__(self, "model", self.usual_model)
        if "model" in given or "effects" not in given:
            wanted = "on" if self.model == "solid" else "off"
            if solid not in ("auto", wanted):
                raise InvalidInputError("effects.solid", solid, f"{wanted} with model = {self.model}", "give only one")
            object.__setattr__(self, "effects", self.effects.model_copy(update={"solid": wanted}))
        elif solid == "off" or (solid == "auto" and self.distance_from_solid("rod") <= self.accuracy):
            object.__setattr__(self, "model", "rod")
        self.require_long_enough()
        return self

    @property
    def friction_star(self) -> float:
        """M_0, rho_a g L*^2."""
        return self.friction_moment / (self.material.force_scale * self.gravity_length)

    @property
    def time_unit(self) -> float:
        """sqrt(L*/g), s."""
        return sqrt(self.gravity_length / self.gravity)

    def as_config(self) -> dict[str, Any]:
        """The resolved keys and values, as they could be given."""
        solid = "on" if self.model == "solid" else "off"
        return {**self.model_dump(), "effects": {**self.effects.model_dump(), "solid": solid}}

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Self:
        """A simulation from a YAML file.

        Raises InvalidInputError: not readable, or a key or value that cannot be used.
        """
        return cls(**read_yaml(path, "scene", "length: 0.6"))
