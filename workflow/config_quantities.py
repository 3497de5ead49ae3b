"""Kinds of numbers and groups of keys that the keys of a configuration share."""

from __future__ import annotations

from typing import Annotated

from stripfold.base.validation import Input, Number, Whole, quantity

OneOrTwo = Annotated[Whole, quantity("1 or 2", ge=1, le=2)]
LengthStar = Annotated[Number, quantity("length of the strip", "L*", gt=0.0)]
Thickness = Annotated[Number, quantity("thickness of the model", "L*", gt=0.0)]
HeightStar = Annotated[Number, quantity("gripper height", "L*", gt=0.0)]
Refinement = Annotated[Number, quantity("element size over that of the standard mesh", gt=0.0)]
Step = Annotated[Number, quantity("size of the steps along the path", "L*", gt=0.0)]
Tolerance = Annotated[Number, quantity("tolerance", "L*", gt=0.0)]
Speed = Annotated[Number, quantity("speed of the gripper", "m s^-1", gt=0.0)]
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
