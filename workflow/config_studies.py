"""The keys of the studies in a configuration, and the kinds of numbers that they share."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from stripfold.errors import InvalidInputError
from stripfold.inputs import Accuracy, AtHeight, EtaB, EtaM, Height, Length, MovingModel
from stripfold.simulation import Release
from stripfold.validation import AtLeastOne, AtLeastThree, AtLeastTwo, Input, Number, Text, Whole, quantity

OneOrTwo = Annotated[Whole, quantity("1 or 2", ge=1, le=2)]
LengthStar = Annotated[Number, quantity("length of the strip", "L*", gt=0.0)]
Thickness = Annotated[Number, quantity("thickness of the model", "L*", gt=0.0)]
HeightStar = Annotated[Number, quantity("gripper height", "L*", gt=0.0)]
Refinement = Annotated[Number, quantity("element size over that of the standard mesh", gt=0.0)]
ElementLength = Annotated[Number, quantity("element length", "L*", gt=0.0)]
Step = Annotated[Number, quantity("size of the steps along the path", "L*", gt=0.0)]
Tolerance = Annotated[Number, quantity("tolerance", "L*", gt=0.0)]
Speed = Annotated[Number, quantity("speed of the gripper", "m s^-1", gt=0.0)]
SpeedStar = Annotated[Number, quantity("speed of the gripper", "sqrt(g L*)", gt=0.0)]
Disturbance = Annotated[Number, quantity("largest initial speed along the critical eigenvector", "sqrt(g L*)")]
AirStar = Annotated[Number, quantity("mass-proportional damping", "sqrt(g/L*)", ge=0.0)]
StiffnessStar = Annotated[Number, quantity("stiffness-proportional damping", "sqrt(L*/g)", ge=0.0)]
TimeStep = Annotated[Number, quantity("time step, over sqrt(L*/g) or the frequency", gt=0.0)]
Until = Annotated[Number, quantity("duration, over sqrt(L*/g) or the frequency", gt=0.0)]
Share = Annotated[Number, quantity("share", ge=0.0, le=1.0)]
Cases = Annotated[Whole, quantity("number of cases", ge=1)]
Repeats = Annotated[Whole, quantity("runs, of which the median is reported", ge=1)]
Seed = Annotated[Whole, quantity("seed of the random numbers", ge=0)]


class OneStrip(Input):
    """One strip at one height, in L*."""

    length_star: LengthStar
    thickness: Thickness
    height: HeightStar


class Sample(Input):
    """Random cases."""

    cases: Cases
    seed: Seed


class Limit(Input):
    """The solid towards the elastica as eta_m vanishes."""

    eta_b: EtaB
    length_star: LengthStar
    height: HeightStar
    eta_m: AtLeastTwo[EtaM]
    refinements: AtLeastTwo[Refinement]


class Order(OneStrip):
    """Measured order of convergence on uniform meshes, each shifted a number of times."""

    sizes: AtLeastTwo[ElementLength]
    phases: Annotated[Whole, quantity("shifts of each mesh", ge=1)]
    reference: Refinement


class Rod(OneStrip):
    """The rod against the solid and the elastica; its convergence at one thickness and height."""

    heights: AtLeastOne[HeightStar]
    thicknesses: AtLeastOne[Thickness]
    refinement: Refinement
    refinements: AtLeastTwo[Refinement]


class Branches(Sample):
    """Random cases that must not jump to another branch."""

    refinement: Refinement
    eta_m: EtaM


class Strategy(Input):
    """A way to the end of the advance: model, and how its contact is treated or where its branch begins."""

    kind: Literal["elastica", "rod", "rod, nodes", "solid", "solid, from lambda_0"]
    order: OneOrTwo | None = None
    across: OneOrTwo | None = None
    refinement: Refinement | None = None
    step: Step | None = None
    tolerance: Tolerance | None = None
    force_tolerance: Annotated[Number | None, quantity("of an equilibrium", "rho_a g L*", gt=0.0)] = None


class AccuracyStudy(Input):
    """Errors against run time."""

    length_star: LengthStar
    thickness: Thickness
    heights: AtLeastOne[HeightStar]
    strategies: AtLeastOne[Strategy]
    reference: Refinement
    accuracies: AtLeastOne[Accuracy]
    repeats: Repeats


class Profiling(Input):
    """Run time of the parts of one lambda_c and of one R-path."""

    length: Length
    height: Height
    eta_b: EtaB
    accuracy: Accuracy
    path_length: Length
    repeats: Repeats


class Estimates(Sample):
    """Random scenes whose true error is compared with its estimate."""


class Tangency(Input):
    """Where R-paths meet the stability boundary."""

    lengths: AtLeastOne[LengthStar]
    thicknesses: AtLeastOne[Thickness]
    refinement: Refinement


class FrictionSteps(Input):
    """Smallest friction against the size of the steps."""

    length: LengthStar
    thickness: Thickness
    steps: AtLeastOne[Step]
    refinement: Refinement


class RandomPaths(Sample):
    """Random gripper paths."""

    refinement: Refinement


class HardCases(Input):
    """Hard cases of the solver."""

    refinement: Refinement


class EffectScene(AtHeight, Release):
    """A scene of `stripfold simulate`, with a name."""

    name: Text


class EffectsStudy(Input):
    """Scenes with each effect on and off."""

    scenes: Annotated[list[EffectScene], Field(min_length=1)]
    repeats: Repeats


class RecordingsAccuracy(Sample):
    """Small synthetic recordings over a design, measured."""

    dynamics: Annotated[Share, Field(description="share of the cases with a motion from the project's dynamics")]


class VideoBenchmark(Input):
    """Speed and memory of measuring a video."""

    frames: Annotated[Whole, quantity("frames of the shorter video", ge=20)]
    repeats: Repeats


class Peers(OneStrip):
    """Other programs on the same strip; may be left out: they need an environment of their own."""

    advance: Annotated[Number, quantity("lambda of the equilibrium", "L*", gt=0.0)]
    repeats: Repeats


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


class Benchmark(Input):
    """Measured run times."""

    repeats: Repeats


class AssessBenchmark(Input):
    """Measured run times of an R-path assessed, with either model."""

    repeats: Repeats
    length: Length


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


class Studies(Input):
    """Benchmarks, verification, other programs; of a study that is left out the stored result is used."""

    limit: Limit | None = None
    order: Order | None = None
    rod: Rod | None = None
    branches: Branches | None = None
    accuracy: AccuracyStudy | None = None
    profiling: Profiling | None = None
    estimates: Estimates | None = None
    tangency: Tangency | None = None
    friction_steps: FrictionSteps | None = None
    random_paths: RandomPaths | None = None
    hard_cases: HardCases | None = None
    effects: EffectsStudy | None = None
    recordings_accuracy: RecordingsAccuracy | None = None
    video_benchmark: VideoBenchmark | None = None
    peers: Peers | None = None
    falls: Falls | None = None
    benchmark: Benchmark | None = None
    assess_benchmark: AssessBenchmark | None = None
    fall_accuracy: FallAccuracy | None = None
    schemes: Schemes | None = None
    modes: Modes | None = None
    lag: Lag | None = None
