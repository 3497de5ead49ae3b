"""What a measured eta_b is asked for with: checked without the libraries that read pictures."""

from __future__ import annotations

from math import hypot, isfinite, nan
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from stripfold.base.errors import MISSING, InvalidInputError
from stripfold.base.validation import Input, Number, Text, quantity, value_meant

GRAM_FORCE = 9.80665e-3
"""N; the unit of Kawabata's bending test."""
KES_B, KES_HB = GRAM_FORCE * 1e-2, GRAM_FORCE
"""1 gf cm^2/cm in N m, and 1 gf cm/cm in N."""
BY_PLATE = "beside the plate it is measured"
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

Of the fabrics in fabrics.csv none lies within these limits in that other unit."""


def _scale_of(ruler: str) -> float:
    """Size of a pixel by two marks of a ruler, m."""
    try:
        x1, y1, x2, y2, length = (float(part) for part in ruler.split(","))
    except ValueError:
        x1 = y1 = x2 = y2 = length = nan
    apart = hypot(x2 - x1, y2 - y1)
    if not (isfinite(apart) and apart >= 10.0 and 1e-3 <= length <= 10.0):
        allowed = "five numbers with commas, marks 10 pixels or more apart and 1 mm to 10 m of length"
        raise InvalidInputError("ruler", ruler, allowed, "as 120,40,620,44,0.1 for 10 cm")
    return length / apart


class EtaRequest(Input):
    """The source of a measured eta_b: the height of a fold or a hanging loop, a picture, or a bending test."""

    fold_height: Annotated[Number | None, quantity("largest height of the loop of a strip folded in half", "m")] = None
    image: Annotated[Text | None, Field(description="picture of the strip from the side, upright")] = None
    scale: Annotated[
        Number | None, quantity("size of a pixel of the picture; without it the picture shows the plate", "m")
    ] = None
    ruler: Annotated[
        Text | None,
        Field(description="x1,y1,x2,y2,length: two marks of a ruler in the picture, pixels, and their distance, m"),
    ] = None
    method: Annotated[
        Literal["fold", "cantilever", "heart", "pear"] | None,
        Field(
            description="content of the picture: a folded or a hanging strip, or one that hangs as a loop; what is "
            "found in it if left out"
        ),
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

    width: Annotated[
        Number | None,
        quantity("width of the strip beside the plate: says how much of its face is seen", "m", gt=0, le=1.0),
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
        if self.ruler is not None:
            if self.scale is not None:
                raise InvalidInputError("ruler", self.ruler, "either this or a scale")
            object.__setattr__(self, "scale", _scale_of(self.ruler))
        for source, key in (("image", "scale"), ("image", "method"), ("loop", "length"), ("loop", "height")):
            value, needed = getattr(self, key), getattr(self, source) is not None
            if value is not None and not needed:
                raise InvalidInputError("ruler" if self.ruler else key, value, f"this only together with {source}")
            if value is None and needed and source == "loop":
                raise InvalidInputError(key, MISSING, f"a {key} together with {source}")
        if self.length is not None and self.height is not None and self.height >= self.length:
            allowed = f"less than the length, {self.length:g} m"
            raise InvalidInputError("height", self.height, allowed, "are the two swapped?")
        for key in ("tilt", "roll", "depth"):
            if getattr(self, key) is not None and self.image is None:
                raise InvalidInputError(key, getattr(self, key), "this only together with image")
        if self.width is not None and (self.image is None or self.scale is not None):
            raise InvalidInputError(
                "width", self.width, "this only together with the image of a plate, without a scale"
            )
        for key in ("tilt", "depth"):
            if getattr(self, key) is not None and self.scale is None:
                raise InvalidInputError(key, getattr(self, key), "this only together with a scale", BY_PLATE)
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
