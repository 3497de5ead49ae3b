"""The keys of the studies of friction, in the fabric and between layers, and of real fabrics."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from config_motion import AirStar, SpeedStar, StiffnessStar
from config_quantities import HeightStar, LengthStar, Refinement, Share, Step, Thickness
from stripfold.ask.inputs import MAX_MU
from stripfold.base.validation import AtLeastOne, AtLeastTwo, Input, Number, Text, quantity

Moment = Annotated[Number, quantity("M_0 of a bending hysteresis", "rho_a g L*^2", ge=0.0)]
Mu = Annotated[Number, quantity("coefficient of friction", ge=0.0, le=MAX_MU)]
Friction = Annotated[Number, quantity("M_0 of bending hysteresis", "rho_a g L*^2", gt=0.0)]
YieldCurvature = Annotated[Number, quantity("kappa_y of bending hysteresis", "1/L*", gt=0.0)]


class FrictionSteps(Input):
    """Smallest friction against the size of the steps."""

    length: LengthStar
    thickness: Thickness
    steps: AtLeastOne[Step]
    refinement: Refinement


class Fabrics(Input):
    """Real fabrics: L* and internal friction."""

    table: Annotated[Text, Field(description="table of measured fabrics")]
    measured: Annotated[Text, Field(description="moment-curvature table of a textile as it is first bent")]
    areal_load: Annotated[Number, quantity("weight of the textile per area", "N m^-2", gt=0.0)]
    height: HeightStar


class TextileLaw(Input):
    """The measured textile with its own bending law, against its secant."""

    table: Annotated[Text, Field(description="moment-curvature table of a textile as it is first bent")]
    areal_load: Annotated[Number, quantity("weight of the textile per area", "N m^-2", gt=0.0)]
    height: HeightStar
    length_star: LengthStar
    thickness: Thickness
    heights: AtLeastOne[HeightStar]
    step: Step
    refinement: Refinement


class FabricLaws(Input):
    """Fabrics that soften, along warp and weft, with their own bending law."""

    table: Annotated[Text, Field(description="table of measured fabrics")]
    height: HeightStar
    length_star: LengthStar
    thickness: Thickness
    flattest: AtLeastOne[Annotated[Number, quantity("least slope of the law over that without curvature", gt=0, lt=1)]]
    step: Step
    refinement: Refinement


class FrictionMargin(Input):
    """Friction that an R-path needs with an eta_b that is known exactly or not."""

    lengths: AtLeastOne[LengthStar]
    uncertainties: AtLeastTwo[Annotated[Number, quantity("relative uncertainty of eta_b", ge=0.0, le=0.5)]]


class FrictionDelay(Input):
    """The end of a motion along x with bending friction."""

    length: LengthStar
    thickness: Thickness
    heights: AtLeastOne[HeightStar]
    moments: AtLeastTwo[Friction]
    checked: Friction
    folded: AtLeastOne[Friction]
    yield_curvature: YieldCurvature
    step: Step


class LayerFriction(Input):
    """The finished fold over the friction between the layers."""

    length_star: LengthStar
    thickness: Thickness
    moment: Moment
    coefficients: AtLeastOne[Mu]
    shown: Mu
    band: AtLeastTwo[Mu]
    long: LengthStar
    fabric_moment: Moment
    speeds: AtLeastOne[SpeedStar]


class FrictionMotion(Input):
    """How a strip with bending friction is followed: in statics, and in time where it is lost."""

    yield_curvature: YieldCurvature
    step: Step
    speed: SpeedStar
    air: AirStar
    stiffness: StiffnessStar


class FrictionTouch(Input):
    """First touches on the triangular and the circular path with bending friction."""

    lengths: AtLeastTwo[LengthStar]
    thickness: Thickness
    moments: AtLeastTwo[Friction]
    checked: LengthStar
    motion: FrictionMotion
    uncertainty: Share


class DisturbedRPath(Input):
    """First touches on a disturbed R-path."""

    length: LengthStar
    thickness: Thickness
    moments: AtLeastOne[Friction]
    eta_b: AtLeastOne[Annotated[Number, quantity("true eta_b over that of the plan", gt=0.0)]]
    rises: AtLeastOne[Annotated[Number, quantity("height by which the gripper is too high", "L*")]]
    vibrations: AtLeastOne[
        tuple[
            Annotated[Number, quantity("amplitude", "L*", ge=0.0)],
            Annotated[Number, quantity("angular frequency", "sqrt(g/L*)", gt=0.0)],
        ]
    ]
    motion: FrictionMotion
