"""The keys of a configuration: names, units, limits and defaults; ``Configuration.model_json_schema()`` shows all."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from config_quantities import HeightStar, LengthStar, OneOrTwo, Refinement, Speed, Step
from config_studies import Studies
from stripfold.ask.inputs import Accuracy, EtaB, EtaM, Gravity, Law, Length, Nu, RhoA
from stripfold.base.errors import MISSING, InvalidInputError
from stripfold.base.material import GRAVITY
from stripfold.base.validation import AtLeastOne, Distinct, Input, Number, Text, quantity


class Solid(Input):
    """How the solid is discretised."""

    order: OneOrTwo = 2
    elements_across: OneOrTwo = 1
    law: Law = "svk"
    accuracy: Accuracy = 1e-3


Friction = Annotated[Number, quantity("M_0 of the bending hysteresis", "rho_a g L*^2", ge=0.0)]


class Recordings(Input):
    """Synthetic recordings that are made and measured."""

    materials: AtLeastOne[Text]
    heights: AtLeastOne[HeightStar]
    speeds: AtLeastOne[Speed]
    friction_moment_star: Annotated[list[Friction], Field(description="M_0 of each of the materials")]
    length_star: LengthStar = 20.0


class Assessment(Input):
    """Folding paths followed by all materials."""

    refinement: Refinement = 1.0
    friction_refinement: Annotated[Refinement, Field(description="for the search of the smallest friction")] = 1.0
    step: Step = 0.1


class Secant(Input):
    """In place of eta_b and rho_a: the secant stiffness of a measured law."""

    table: Annotated[Text, Field(description="CSV file of moment over curvature")]
    areal_load: Annotated[Number, quantity("weight per area", "N m^-2", gt=0.0)]
    height: Annotated[Number, quantity("height whose critical state sets the curvature", "L*")]
    stiffness: Annotated[Number | None, quantity("filled in: bending stiffness per width", "N m")] = None
    kappa: Annotated[Number | None, quantity("filled in: curvature of the secant", "m^-1")] = None


class MaterialEntry(Input):
    """A strip of the x-axis study."""

    name: Annotated[
        str, Field(pattern=r"^[a-z][a-z0-9_]*$", description="used in file names: small letters, digits and _")
    ]
    label: Annotated[Text, Field(description="used in figures")]
    source: Annotated[Text, Field(description="where the numbers are from")]
    eta_b: EtaB | None = None
    eta_m: EtaM = 1e-3
    nu: Nu = 0.0
    rho_a: RhoA | None = None
    length: Length
    heights: AtLeastOne[HeightStar]
    touching_heights: Distinct[HeightStar] = Field(default_factory=list, description="heights of which none snaps")
    secant: Secant | None = None

    @model_validator(mode="after")
    def _check_stiffness(self) -> Self:
        if self.eta_b is None and self.secant is None:
            raise InvalidInputError("eta_b", MISSING, "a number, m^-4 s^2", "or give secant instead")
        return self


class Configuration(Input):
    """Configuration of a run."""

    results: Annotated[Text, Field(description="folder of the stored results")] = "results"
    figures: Annotated[Text, Field(description="folder of the figures")] = "figures"
    collapse: Annotated[Text, Field(description="scene file of the simulated and filmed collapse")] = (
        "workflow/config/collapse.yaml"
    )
    gravity: Gravity = GRAVITY
    solid: Solid = Solid()
    images: Annotated[
        Text, Field(description="folder of the public test pictures; without it the stored results are used")
    ] = "../shared/data"
    recordings: Recordings
    assessment: Assessment = Assessment()
    materials: Annotated[list[MaterialEntry], Field(min_length=1)]
    studies: Studies

    @model_validator(mode="after")
    def _check_names(self) -> Self:
        names = [material.name for material in self.materials]
        for i, name in enumerate(names):
            if name in names[:i]:
                raise InvalidInputError(f"materials[{i}].name", name, "a name that no other material has")
        for i, name in enumerate(self.recordings.materials):
            if name not in names:
                raise InvalidInputError(f"recordings.materials[{i}]", name, f"one of the materials {', '.join(names)}")
        filmed, frictions = len(self.recordings.materials), len(self.recordings.friction_moment_star)
        if frictions != filmed:
            raise InvalidInputError(
                "recordings.friction_moment_star", f"{frictions} numbers", f"{filmed}, one for each material"
            )
        return self
