"""Effects on demand: which effects a simulation knows, what is asked of them, and when each is needed.

Each test is a pure function of numbers that the simulation has anyway; it says what it compared with what.
Source: ``docs/effects.md``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from difflib import get_close_matches
from typing import Any

from stripfold.analysis.model_error import model_error
from stripfold.errors import InvalidInputError

CONTACT, SELF_CONTACT, INERTIA = "contact", "self_contact", "inertia"
FRICTION, SOLID, MEMBRANE = "friction", "solid", "membrane"
EFFECTS = (CONTACT, SELF_CONTACT, INERTIA, FRICTION, SOLID, MEMBRANE)
AUTO, ON, OFF = SETTINGS = ("auto", "on", "off")

STRETCH_EFFECT = 0.72
"""Largest distance of the solid's lambda_c from that of a strip that does not stretch, over (h/L*)^2 of itself, in
the study ``rod``: h/L* squared is 12 times the membrane strain under the weight of L*, eta_m g L*."""
UNSTRETCHED = 1e-3
"""h of a strip that is to have no membrane stretch, L*: a millionth of it is left in lambda_c."""


@dataclass(frozen=True, slots=True)
class Choices:
    """What is asked of each effect: "auto", "on" or "off"."""

    contact: str = AUTO
    self_contact: str = AUTO
    inertia: str = AUTO
    friction: str = AUTO
    solid: str = AUTO
    membrane: str = AUTO

    @classmethod
    def of(cls, given: Any) -> Choices:
        """From what a scene has under ``effects``: "auto", or a mapping from effects to settings.

        Raises
        ------
        InvalidInputError
            No such effect or setting, or one that a simulation cannot do.
        """
        if given == AUTO:
            return cls()
        if not isinstance(given, Mapping):
            raise InvalidInputError("effects", given, "auto, or keys and values as self_contact: off")
        settings: dict[str, str] = {}
        for name, setting in given.items():
            key = f"effects.{name}"
            if name not in EFFECTS:
                near = get_close_matches(str(name), EFFECTS, 1)
                advice = f"did you mean {near[0]}?" if near else "remove it"
                raise InvalidInputError(key, setting, f"one of the effects {', '.join(EFFECTS)}", advice)
            # YAML takes on and off for true and false.
            settings[name] = (ON if setting else OFF) if isinstance(setting, bool) else setting
            if settings[name] not in SETTINGS:
                raise InvalidInputError(key, setting, ", ".join(SETTINGS))
        choices = cls(**settings)
        if choices.contact == OFF:
            advice = "the strip begins lying on the floor: without it there is no state to start from"
            raise InvalidInputError("effects.contact", OFF, f"{AUTO} or {ON}", advice)
        if choices.friction == ON:
            advice = "a fall has no internal friction; `stripfold assess` has, with --friction or --hysteresis"
            raise InvalidInputError("effects.friction", ON, f"{AUTO} or {OFF}", advice)
        return choices

    def with_model(self, model: str, asked: bool) -> Choices:
        """With the solid on or off as a model says that was ``asked`` for; else it stays as it is.

        Raises
        ------
        InvalidInputError
            Both were asked for, and contradict each other.
        """
        if not asked:
            return self
        solid = ON if model == "solid" else OFF
        if self.solid not in (AUTO, solid):
            raise InvalidInputError("effects.solid", self.solid, f"{solid} with model = {model}", "give one of both")
        return replace(self, solid=solid)

    def as_config(self) -> dict[str, str]:
        """The settings by effect."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class Need:
    """Whether a scene needs an effect: what was compared with what, in units of L*, and why, in words."""

    needed: bool
    value: float
    threshold: float
    reason: str


def need_of_contact(lowest: float) -> Need:
    """From the lowest height over the floor, L*."""
    return Need(lowest <= 0.0, lowest, 0.0, f"the lowest point is {lowest:.2g} L* over the floor")


def need_of_self_contact(gap: float) -> Need:
    """From the smallest distance of layers above the floor less the thickness, L*."""
    if gap == float("inf"):
        return Need(False, gap, 0.0, "nowhere above the floor two layers come near each other")
    words = f"{gap:.2g} L* more than the thickness is the smallest distance of layers above the floor"
    return Need(gap < 0.0, gap, 0.0, words)


def need_of_inertia(slope: float, kinetic_share: float | None) -> Need:
    """From the slope of lambda where the smooth advance ends, and the largest share of what is released that moves."""
    words = "lambda has a maximum: no equilibrium is near behind it"
    if kinetic_share is not None:
        words += f"; up to {kinetic_share:.0%} of what it had and released is in motion"
    return Need(slope <= 0.0, slope, 0.0, words if slope <= 0.0 else "lambda has no maximum: statics go on")


def need_of_friction() -> Need:
    """Nothing in a scene tells that a fabric has internal friction: it has to be named."""
    return Need(False, 0.0, 0.0, "the scene names no internal friction")


def need_of_solid(thickness: float, nu: float, accuracy: float) -> Need:
    """From the thickness, L*, Poisson's ratio, and the wanted relative accuracy of lambda_c."""
    error = model_error("rod", thickness, nu)
    return Need(
        error > accuracy, error, accuracy, f"a rod's lambda_c is up to {error:.1e} of itself away from the solid's"
    )


def need_of_membrane(thickness: float, accuracy: float) -> Need:
    """From the thickness, L*, and the wanted relative accuracy of lambda_c."""
    error = STRETCH_EFFECT * thickness**2
    words = (
        f"membrane stretch moves lambda_c by {error:.1e} of itself; every model has it, leaving it out saves nothing"
    )
    return Need(error > accuracy, error, accuracy, words)
