"""The keys of the studies in a configuration."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from config_friction import (
    DisturbedRPath,
    FabricLaws,
    Fabrics,
    FrictionDelay,
    FrictionMargin,
    FrictionSteps,
    FrictionTouch,
    LayerFriction,
    Moment,
    Mu,
    TextileLaw,
)
from config_motion import FallAccuracy, Falls, Lag, Modes, Schemes, SpeedStar
from config_quantities import (
    Cases,
    HeightStar,
    LengthStar,
    OneOrTwo,
    OneStrip,
    Refinement,
    Repeats,
    Sample,
    Seed,
    Share,
    Thickness,
    Tolerance,
)
from stripfold.ask.inputs import Accuracy, AtHeight, EtaB, EtaM, Height, Length, Release
from stripfold.base.validation import AtLeastOne, AtLeastTwo, Input, Number, Text, Whole, quantity

Parts = Annotated[Whole, quantity("parts of each element", ge=1)]
Distance = Annotated[Number, quantity("distance to lambda_c", "L*", gt=0.0)]
PerAxis = Annotated[Whole, quantity("values of each of two keys", ge=2)]


class Limit(Input):
    """The solid towards the elastica as eta_m vanishes."""

    eta_b: EtaB
    length_star: LengthStar
    height: HeightStar
    eta_m: AtLeastTwo[EtaM]
    refinement: Refinement


class Order(OneStrip):
    """Measured order of convergence and run time on meshes refined uniformly."""

    refinement: Refinement
    parts: AtLeastTwo[Parts]
    reference: Parts


class Rod(Input):
    """The rod against the solid and the elastica."""

    length_star: LengthStar
    heights: AtLeastOne[HeightStar]
    thicknesses: AtLeastOne[Thickness]
    refinement: Refinement


class Branches(Sample):
    """Random cases that must not jump to another branch; the first are run on a finer mesh too."""

    compared: Annotated[Whole, quantity("cases run on a finer mesh too", ge=0)]
    refinement: Refinement
    eta_m: EtaM


class LowPaths(Sample):
    """Random low paths, the first of them on the solid too, and a strip in time."""

    compared: Annotated[Whole, quantity("cases run on the solid and a finer mesh too", ge=0)]
    length_star: LengthStar
    thickness: Thickness
    heights: AtLeastOne[HeightStar]
    coefficients: AtLeastOne[Mu]
    moment: Moment
    speed: SpeedStar


class Barrier(Input):
    """The energy barrier over the distance to lambda_c."""

    heights: AtLeastOne[HeightStar]
    distances: AtLeastOne[Distance]
    length_star: LengthStar
    thickness: Thickness
    refinement: Refinement
    range_heights: AtLeastOne[HeightStar]


class SecondGripper(Input):
    """A second gripper's places on strips of the height and a length ``beyond`` it."""

    heights: AtLeastOne[HeightStar]
    places: Annotated[Whole, quantity("scanned at each height", ge=1)]
    distances: AtLeastOne[Distance]
    beyond: LengthStar
    thickness: Thickness


class StabilityMap(Input):
    """The stability map against critical points found one by one, and with paths on it."""

    lengths: AtLeastOne[LengthStar]
    checked: Annotated[Whole, quantity("random heights for each length", ge=1)]
    seed: Seed
    rod_heights: AtLeastOne[HeightStar]
    thicknesses: AtLeastOne[Thickness]
    refinement: Refinement
    length_star: LengthStar
    low_height: HeightStar
    height: HeightStar
    distances: AtLeastOne[Distance]
    repeats: Repeats


class Eigenvalues(OneStrip):
    """Eigenvalues to the critical points along x and along paths."""

    refinement: Refinement


class Explorer(Sample):
    """Places of the gripper on the explorer's page."""

    length_star: LengthStar


class Variants(OneStrip):
    """What each choice of the model changes."""

    refinement: Refinement
    poisson: AtLeastOne[Annotated[Number, quantity("Poisson's ratio", ge=0.0, lt=0.5)]]
    eta_m: AtLeastOne[Annotated[Number, quantity("factor on eta_m", gt=0.0)]]
    narrow: Annotated[Number, quantity("Poisson's ratio of a narrow strip", ge=0.0, lt=0.5)]
    angles: AtLeastOne[Annotated[Number, quantity("angle of the strip at the gripper", "degree")]]
    compliance: Annotated[Number, quantity("displacement of the pin per force", "(rho_a g)^-1", ge=0.0)]
    sliding: Annotated[Number, quantity("force at which the pin slides", "rho_a g L*", gt=0.0)]


class Knocks(Input):
    """Knocks on a hanging strip in time."""

    height: HeightStar
    thickness: Thickness
    refinement: Refinement
    distances: AtLeastTwo[Distance]
    bisections: Annotated[Whole, quantity("bisections of the energy", ge=1)]


class Strategy(Input):
    """A way to the end of the advance: model, mesh and tolerance."""

    kind: Literal["elastica", "rod", "solid"]
    order: OneOrTwo | None = None
    across: OneOrTwo | None = None
    refinement: Refinement | None = None
    tolerance: Tolerance | None = None


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


class RandomPaths(Sample):
    """Random gripper paths."""

    refinement: Refinement


class SolverConstants(Input):
    """Numerical constants counted in the solver's modules."""

    packages: AtLeastOne[Text]
    before: Annotated[Whole, quantity("number before the lift-off was an unknown", ge=0)]
    later: list[Text]


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


class EtaPictures(Sample):
    """eta_b from drawn folds, and from pictures that show no strip."""

    scenes: Annotated[Whole, quantity("drawn pictures without a strip, of each kind", ge=1)]
    thicknesses: AtLeastOne[Annotated[Number, quantity("thickness of a fold's strip", "L*", gt=0.0, le=0.3)]]


class VideoBenchmark(Input):
    """Time and memory of measuring a recording."""

    frames: Annotated[Whole, quantity("frames of the shorter film, about", ge=150)]
    repeats: Repeats


class Peers(OneStrip):
    """Other programs on the same strip; may be left out: they need an environment of their own."""

    advance: Annotated[Number, quantity("lambda of the equilibrium", "L*", gt=0.0)]
    repeats: Repeats


class Benchmark(Input):
    """Measured run times."""

    repeats: Repeats


class AssessBenchmark(Input):
    """Measured run times of an R-path assessed, with either model."""

    repeats: Repeats
    length: Length


class Sweeps(Input):
    """Sweeps over as many heights as values of eta_b, random scenes of which are found again."""

    elastica: PerAxis
    rod: PerAxis
    checked: Cases
    seed: Seed


class FoldingPlans(Input):
    """Plans for random strips."""

    cases: Cases
    seed: Seed


class Commands(Input):
    """All commands, each several times."""

    repeats: Annotated[Whole, quantity("times that each runs", ge=2)]


class Fuzz(Input):
    """Generated inputs of all commands."""

    inputs: Annotated[Whole, quantity("inputs", ge=10)]
    seed: Seed


class Studies(Input):
    """Benchmarks, verification, other programs; of a study that is left out the stored result is used."""

    limit: Limit | None = None
    order: Order | None = None
    rod: Rod | None = None
    branches: Branches | None = None
    low_paths: LowPaths | None = None
    barrier: Barrier | None = None
    stability_map: StabilityMap | None = None
    knocks: Knocks | None = None
    second_gripper: SecondGripper | None = None
    eigenvalues: Eigenvalues | None = None
    variants: Variants | None = None
    solver_constants: SolverConstants | None = None
    accuracy: AccuracyStudy | None = None
    profiling: Profiling | None = None
    estimates: Estimates | None = None
    tangency: Tangency | None = None
    friction_steps: FrictionSteps | None = None
    friction_delay: FrictionDelay | None = None
    friction_touch: FrictionTouch | None = None
    disturbed_rpath: DisturbedRPath | None = None
    fabrics: Fabrics | None = None
    textile_law: TextileLaw | None = None
    fabric_laws: FabricLaws | None = None
    friction_margin: FrictionMargin | None = None
    layer_friction: LayerFriction | None = None
    random_paths: RandomPaths | None = None
    hard_cases: HardCases | None = None
    effects: EffectsStudy | None = None
    recordings_accuracy: RecordingsAccuracy | None = None
    strip_looks: Sample | None = None
    camera_bump: Sample | None = None
    markerless: Sample | None = None
    eta_pictures: EtaPictures | None = None
    video_benchmark: VideoBenchmark | None = None
    explorer: Explorer | None = None
    peers: Peers | None = None
    falls: Falls | None = None
    benchmark: Benchmark | None = None
    assess_benchmark: AssessBenchmark | None = None
    commands: Commands | None = None
    fuzz: Fuzz | None = None
    sweeps: Sweeps | None = None
    folding_plans: FoldingPlans | None = None
    fall_accuracy: FallAccuracy | None = None
    schemes: Schemes | None = None
    modes: Modes | None = None
    lag: Lag | None = None
