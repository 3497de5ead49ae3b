"""Inputs about a strip, validated once; names, units, limits and help texts have their source here.

All numbers in SI; what goes together is checked in L*, where the limits are much sharper.
"""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from stripfold.ask.model_error import model_error
from stripfold.base.errors import MISSING, InvalidInputError
from stripfold.base.material import GRAVITY, Material
from stripfold.base.validation import Flag, Input, Number, Text, quantity, value_meant

ETA_B = (1e-1, 1e8)
"""Allowed weight-to-bending-stiffness ratios, m^-4 s^2: from a metal sheet to a gauze."""
LENGTH_STAR = (3.0, 150.0)
"""Allowed strip lengths, L*.  The shortest strip that can snap is twice as long; the longest is a matter of cost."""
HEIGHT_STAR = (0.1, 60.0)
"""Allowed gripper heights, L*; below the lowest the planning model has not been tested."""
MAX_THICKNESS_STAR = 0.2
"""Largest thickness of the model, L*: at 0.3 the solid's lambda_c depends on the mesh (docs/hard-cases.md)."""
LARGEST_PUSH, MAX_COMPRESSION = 2.75, 0.9
"""Largest push of a low gripper times its height squared, in L*, and largest compression of the strip by it over its
height: from there on the strip snaps at that push, where the force on one node decides (docs/hard-cases.md)."""
MAX_MU = 5.0
"""Largest coefficient of friction; those of fabrics on fabrics are 0.2 to 1."""
GRAM_FORCE = 9.80665e-3
"""N; the unit of Kawabata's bending test."""
KES_B, KES_HB = GRAM_FORCE * 1e-2, GRAM_FORCE
"""1 gf cm^2/cm in N m, and 1 gf cm/cm in N."""
UNSTRETCHED = 1e-6
"""eta_m, m^-2 s^2, of a strip that hardly stretches: any strip with it is thin."""

Model = Literal["solid", "rod", "elastica", "auto"]
MovingModel = Literal["solid", "rod"]
Law = Literal["svk", "printed"]

Length = Annotated[Number, quantity("length of the strip", "m", ge=1e-6, le=1e6)]
Height = Annotated[Number, quantity("height of the gripper", "m", ge=1e-6, le=1e6)]
EtaB = Annotated[Number, quantity("weight-to-bending-stiffness ratio", "m^-4 s^2", ge=ETA_B[0], le=ETA_B[1])]
EtaM = Annotated[Number, quantity("weight-to-membrane-stiffness ratio", "m^-2 s^2", ge=1e-9, le=0.1)]
Nu = Annotated[Number, quantity("Poisson's ratio", ge=0.0, le=0.49)]
RhoA = Annotated[Number, quantity("areal density; scales forces only", "kg m^-2", ge=1e-4, le=1e3)]
Gravity = Annotated[Number, quantity("gravitational acceleration", "m s^-2", ge=0.1, le=100.0)]
Accuracy = Annotated[Number, quantity("requested relative accuracy of lambda_c", ge=1e-6, le=0.1)]
Air = Annotated[Number, quantity("mass-proportional damping", "s^-1", ge=0.0, le=100.0)]
Stiffness = Annotated[Number, quantity("stiffness-proportional damping", "s", ge=0.0, le=1.0)]


class Strip(Input):
    """A strip of fabric.

    Raises
    ------
    InvalidInputError
        A number outside its limits, or a combination that is no strip, as with a wrong unit.
    """

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

        The advance ends at the critical point, or where the sag touches the lower layer first.  The free length there
        is the elastica's, which differs little from the solid's.

        Raises
        ------
        InvalidInputError
            The strip is too short for this height; the message says how long it must be.
        SolveError
            The elastica could not be solved.
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


class Scene(AtHeight):
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

    def with_eta_b(self, eta_b: float) -> Scene:
        """The same scene with another eta_b."""
        return Scene(**{**self.model_dump(), "eta_b": eta_b})

    @model_validator(mode="after")
    def _check_law(self) -> Self:
        if self.model != "solid" and self.law != "svk":
            raise InvalidInputError("law", self.law, "svk", "only the solid has another law")
        return self


class PlannedPath(Input):
    """A path of a kind, for a strip."""

    fold_at: Annotated[
        Number | None, quantity("distance of the fold line from the gripped end; by default half the length", "m")
    ] = None
    height: Annotated[Number | None, quantity("height of the gripper on the low path", "m")] = None


class OwnPath(Input):
    """How a table is to be read as a path; :class:`.LogFormat` says what the texts may be."""

    columns: Text | None = None
    unit: Text | None = None
    frame: Text | None = None
    smooth: Number | None = None


class PathAssessment(Strip):
    """A strip to be moved along a path, its model, its falls and its friction."""

    model: Annotated[MovingModel, Field(description="the paper's finite elements, or a rod")] = "solid"
    fall: Annotated[Flag, Field(description="simulate the fall at a critical point, and go on after it")] = False
    friction_moment: Annotated[
        Number | None, quantity("M_0 of the fabric's bending hysteresis, per width", "N", ge=0.0, le=1e3)
    ] = None
    pull: Annotated[Number | None, quantity("k_f of the paper's internal friction", "s^-2", ge=0.0, le=1e9)] = None
    layer_friction: Annotated[
        Number | None,
        quantity("coefficient of friction between the layers and on the floor; followed in time", ge=0.0, le=MAX_MU),
    ] = None
    step: Annotated[Number | None, quantity("step size with friction; by default 0.1 L*", "m", ge=1e-9, le=1e6)] = None

    second_gripper: SecondPlace = None

    @model_validator(mode="after")
    def _check_second_gripper(self) -> Self:
        laws = self.friction_moment, self.pull, self.layer_friction
        if self.second_gripper is not None and any(law is not None for law in laws):
            raise InvalidInputError("second_gripper", self.second_gripper, "no friction together with it")
        return self

    @model_validator(mode="after")
    def _check_friction(self) -> Self:
        if self.friction_moment is not None and self.pull is not None:
            raise InvalidInputError("pull", self.pull, "nothing together with friction_moment", "give only one")
        internal = self.friction_moment is not None or self.pull is not None
        if self.fall and internal:
            raise InvalidInputError("fall", self.fall, "no fall together with friction_moment or pull")
        if self.layer_friction is not None and (self.fall or self.pull is not None):
            advice = "with it a path is followed in time: falls are part of it, and the pull is not defined there"
            raise InvalidInputError("layer_friction", self.layer_friction, "neither fall nor pull with it", advice)
        if self.step is not None and not internal:
            raise InvalidInputError("step", self.step, "a step together with friction_moment or pull")
        return self


class StabilityMap(Strip):
    """A strip whose gripper's places are mapped, and its friction."""

    friction_moment: FrictionMoment = None


class FoldingPlan(Strip):
    """A strip to be folded, how well it is known, and what the robot may do."""

    eta_b_uncertainty: Annotated[Number, quantity("relative uncertainty of eta_b, as 0.2 or 20%", ge=0.0, le=0.5)] = 0.2
    margin: Annotated[
        Number, quantity("distance of the gripper from where the strip snaps, for every eta_b", "m", ge=0.0, le=1e6)
    ] = 0.01
    layers_may_slide: Annotated[Flag, Field(description="the upper layer may slide over the lower one")] = False
    friction_moment: FrictionMoment = None
    yield_curvature: Annotated[Number | None, quantity("its kappa_y; by default 0.05 / L*", "1/m", ge=1e-3, le=1e6)] = (
        None
    )
    speed: Annotated[
        Number | None,
        quantity(
            "largest speed of the gripper, checked in time; 0.1 and unchecked if left out", "m s^-1", ge=1e-4, le=10.0
        ),
    ] = None
    acceleration: Annotated[Number, quantity("largest acceleration of it", "m s^-2", ge=1e-3, le=100.0)] = 0.5

    @model_validator(mode="after")
    def _check_margin(self) -> Self:
        if not self.margin < self.length:
            advice = value_meant(self.margin, "m", 0.0, 0.25 * self.length)
            raise InvalidInputError("margin", self.margin, f"less than the length, {self.length:g} m", advice)
        return self

    @model_validator(mode="after")
    def _check_friction(self) -> Self:
        if self.yield_curvature is not None and self.friction_moment is None:
            raise InvalidInputError("yield_curvature", self.yield_curvature, "this together with friction_moment")
        return self

    @property
    def gripper_speed(self) -> float:
        """The speed, or the usual one, m/s."""
        return 0.1 if self.speed is None else self.speed

    @cached_property
    def strips(self) -> tuple[Strip, Strip, Strip]:
        """The strip with the least, the given and the largest eta_b: the stiffest first."""
        known = {name: getattr(self, name) for name in Strip.model_fields}
        factors = (1.0 - self.eta_b_uncertainty, 1.0, 1.0 + self.eta_b_uncertainty)
        stiffest, given, softest = (Strip(**{**known, "eta_b": factor * self.eta_b}) for factor in factors)
        return stiffest, given, softest


PLAUSIBLE = {
    "scale": (1e-7, 1e-2, "mm", 1e-3),
    "fold_height": (2e-3, 0.3, "", 0.0),
    "bending_length": (2e-3, 0.3, "", 0.0),
    "rigidity": (1e-7, 1e-2, "uN m", 1e-6),
    "kes_b": (1e-3, 10.0, "N m", 1.0 / KES_B),
    "kes_2hb": (2e-3, 10.0, "N", 1.0 / KES_HB),
    "gsm": (2.0, 1e4, "kg m^-2", 1e3),
}
"""Least and largest value, from a gauze to a thin metal sheet; another unit that it may be given in, and its factor.

Of the fabrics in data/fabrics.csv none lies within these limits in that other unit."""


class EtaRequest(Input):
    """The source of a measured eta_b: the height of a fold or a hanging loop, a picture, or a bending test."""

    fold_height: Annotated[Number | None, quantity("largest height of the loop of a strip folded in half", "m")] = None
    image: Annotated[Text | None, Field(description="picture of the strip from the side, upright")] = None
    scale: Annotated[Number | None, quantity("size of a pixel of the picture", "m")] = None
    method: Annotated[
        Literal["fold", "cantilever"] | None, Field(description="content of the picture: a folded or a hanging strip")
    ] = None
    slope: Annotated[
        Number | None,
        quantity(
            "angle of a hanging strip below the horizontal at its clamp; fitted if left out",
            "degrees",
            ge=-60.0,
            le=80.0,
        ),
    ] = None
    tilt: Annotated[
        Number | None,
        quantity(
            "largest angle between the camera's axis and the width of the strip that is not excluded; 3 if left out",
            "degrees",
            ge=0.0,
            le=10.0,
        ),
    ] = None
    roll: Annotated[
        Number | None,
        quantity(
            "largest angle between the picture's rows and the horizontal that is not excluded; 1 if left out",
            "degrees",
            ge=0.0,
            le=10.0,
        ),
    ] = None
    depth: Annotated[
        Number | None,
        quantity(
            "largest width of the strip over its distance from the camera that is not excluded; 0.05 if left out",
            ge=0.0,
            le=0.5,
        ),
    ] = None

    loop: Annotated[
        Literal["heart", "pear"] | None,
        Field(description="strip that hangs from its ends, held together: these point upwards, or downwards"),
    ] = None
    length: Annotated[Number | None, quantity("length of that strip", "m", gt=0.0)] = None
    height: Annotated[Number | None, quantity("from its ends to its lowest point", "m", gt=0.0)] = None
    bending_length: Annotated[
        Number | None, quantity("Peirce's bending length, (rigidity / weight)^(1/3): it is L*", "m")
    ] = None
    rigidity: Annotated[Number | None, quantity("bending stiffness per width, with gsm", "N m")] = None
    kes_b: Annotated[Number | None, quantity("B of Kawabata's bending test, with gsm", "gf cm^2/cm")] = None
    kes_2hb: Annotated[Number | None, quantity("2HB of that test: the friction in bending", "gf cm/cm")] = None
    gsm: Annotated[Number | None, quantity("weight per area, with rigidity or kes_b", "g m^-2")] = None

    @model_validator(mode="after")
    def _check_source(self) -> Self:
        sources = ("fold_height", "image", "loop", "bending_length", "rigidity", "kes_b")
        if sum(getattr(self, key) is not None for key in sources) != 1:
            raise InvalidInputError("fold_height", self.fold_height, f"one of {', '.join(sources)}")
        stiffness = self.rigidity if self.kes_b is None else self.kes_b
        if (self.gsm is None) != (stiffness is None):
            raise InvalidInputError("gsm", MISSING if self.gsm is None else self.gsm, "this with rigidity or kes_b")
        if self.kes_2hb is not None and self.kes_b is None:
            raise InvalidInputError("kes_2hb", self.kes_2hb, "this only together with kes_b")
        for source, key in (("image", "scale"), ("image", "method"), ("loop", "length"), ("loop", "height")):
            value, needed = getattr(self, key), getattr(self, source) is not None
            if value is not None and not needed:
                raise InvalidInputError(key, value, f"this only together with {source}")
            if value is None and needed:
                raise InvalidInputError(key, MISSING, f"a {key} together with {source}")
        if self.length is not None and self.height is not None and self.height >= self.length:
            allowed = f"less than the length, {self.length:g} m"
            raise InvalidInputError("height", self.height, allowed, "are the two swapped?")
        for key in ("tilt", "roll", "depth"):
            if getattr(self, key) is not None and self.image is None:
                raise InvalidInputError(key, getattr(self, key), "this only together with image")
        if self.slope is not None and self.method != "cantilever":
            raise InvalidInputError("slope", self.slope, "this only together with method: cantilever")
        for key, (low, high, other, factor) in PLAUSIBLE.items():
            value = getattr(self, key)
            if value is not None and not low <= value <= high:
                unit = str(type(self).model_fields[key].json_schema_extra["unit"])  # type: ignore[index]
                meant = f"{value:g} {other} are {value * factor:g}" if low <= value * factor <= high else ""
                advice = ": ".join(filter(None, (f"the unit is {unit}", meant or value_meant(value, unit, low, high))))
                raise InvalidInputError(key, value, f"from {low:g} to {high:g} {unit}", advice)
        return self
