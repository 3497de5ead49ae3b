"""The keys of the studies of a strip in motion."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from config_quantities import HeightStar, LengthStar, OneStrip, Refinement, Repeats, Thickness, Tolerance
from stripfold.ask.inputs import MovingModel
from stripfold.base.errors import InvalidInputError
from stripfold.base.validation import AtLeastOne, AtLeastThree, AtLeastTwo, Input, Number, Text, Whole, quantity

SpeedStar = Annotated[Number, quantity("speed of the gripper", "sqrt(g L*)", gt=0.0)]
Disturbance = Annotated[Number, quantity("largest initial speed along the critical eigenvector", "sqrt(g L*)")]
AirStar = Annotated[Number, quantity("mass-proportional damping", "sqrt(g/L*)", ge=0.0)]
StiffnessStar = Annotated[Number, quantity("stiffness-proportional damping", "sqrt(L*/g)", ge=0.0)]
TimeStep = Annotated[Number, quantity("time step, over sqrt(L*/g) or the frequency", gt=0.0)]
Until = Annotated[Number, quantity("duration, over sqrt(L*/g) or the frequency", gt=0.0)]


class Fall(Input):
    """The first fall, called base."""

    length: LengthStar
    thickness: Thickness
    height: HeightStar
    disturbance: Disturbance
    air: AirStar
    stiffness: StiffnessStar
    refinement: Refinement
    tolerance: Tolerance


class FallCase(Input):
    """The changes of a further fall from the first."""

    name: Text
    length: LengthStar | None = None
    thickness: Thickness | None = None
    height: HeightStar | None = None
    disturbance: Disturbance | None = None
    air: AirStar | None = None
    stiffness: StiffnessStar | None = None
    refinement: Refinement | None = None
    tolerance: Tolerance | None = None

    @model_validator(mode="after")
    def _check_changed(self) -> Self:
        if len(self.model_fields_set) < 2:
            raise InvalidInputError("", {"name": self.name}, "at least one change of the base")
        return self


class Falls(Input):
    """Hard and easy falls of a strip."""

    base: Fall
    cases: Annotated[list[FallCase], Field(min_length=1)]


class FallWay(Input):
    """A way to follow a fall."""

    model: MovingModel
    refinement: Refinement | None = None
    scheme: Literal["energy-momentum", "energy-momentum, conserving", "generalised-alpha"] | None = None
    tolerance: Tolerance | None = None


class FallAccuracy(Input):
    """Accuracy of a fall's first touch against run time; the reference, and another to check it."""

    length_star: LengthStar
    thickness: Thickness
    heights: AtLeastOne[HeightStar]
    disturbance: Disturbance
    ways: Annotated[list[FallWay], Field(min_length=1)]
    reference: tuple[FallWay, FallWay]
    repeats: Repeats


class Schemes(OneStrip):
    """Time integration schemes compared."""

    refinement: Refinement
    oscillator_steps: AtLeastTwo[TimeStep]
    oscillator_until: Until
    swing_steps: AtLeastTwo[TimeStep]
    swing_until: Until


class Modes(Input):
    """Frequencies of a clamped strip."""

    length_star: LengthStar
    thickness: Thickness
    elements: Annotated[Whole, quantity("elements along the strip", ge=4)]
    modes: Annotated[Whole, quantity("number of modes, from the lowest", ge=1)]
    periods: Annotated[Whole, quantity("periods observed of each", ge=2)]
    steps: AtLeastOne[Annotated[Whole, quantity("time steps per period", ge=8)]]


class Lag(OneStrip):
    """Lag of the snap behind a moving gripper, without damping and in air."""

    refinement: Refinement
    speeds: AtLeastThree[SpeedStar]
    air: Annotated[Number, quantity("mass-proportional damping", "sqrt(g/L*)", gt=0.0)]
    damped_speeds: AtLeastThree[SpeedStar]
