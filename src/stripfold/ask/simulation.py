"""Inputs of a simulated collapse: the strip and the height, its release, and the effects; in SI."""

from __future__ import annotations

import os
from collections.abc import Mapping
from math import sqrt
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from stripfold.ask.inputs import MAX_MU, Air, AtHeight, MovingModel, Stiffness
from stripfold.base.errors import InvalidInputError
from stripfold.base.validation import Input, Number, quantity, read_yaml


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
        if self.friction == "on":
            advice = "a fall has no internal friction; `stripfold assess` has, with --friction-moment or --pull"
            raise InvalidInputError("friction", "on", "auto or off", advice)
        return self


def _all_auto(value: Any) -> Any:
    if value == "auto":
        return Effects()
    if not isinstance(value, Mapping | Effects):
        raise InvalidInputError("", value, "auto, or keys and values as self_contact: off")
    return value


class Simulation(AtHeight, Release):
    """A strip through its collapse: a scene, how the strip is released, and with which effects.

    The model is the solid, or what ``model`` says; with ``effects`` and without ``model``, what those say or need.
    """

    model: Annotated[
        MovingModel, Field(description="the paper's finite elements, or a rod; the elastica has no motion in time")
    ] = "solid"
    layer_friction: Annotated[
        Number, quantity("coefficient of friction between the layers and on the floor", ge=0.0, le=MAX_MU)
    ] = 0.0
    effects: Annotated[Effects, BeforeValidator(_all_auto)] = Effects()

    @model_validator(mode="after")
    def _resolve_model(self) -> Self:
        given = self.model_fields_set
        solid = self.effects.solid
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
