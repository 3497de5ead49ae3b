"""Quantities of a strip that several input models have: their names in words, units and limits, SI."""

from __future__ import annotations

from typing import Annotated, Literal

from stripfold.base.validation import Number, quantity

ETA_B = (1e-1, 1e8)
"""Allowed weight-to-bending-stiffness ratios, m^-4 s^2: from a metal sheet to a gauze."""
HEIGHT_STAR = (0.1, 60.0)
"""Allowed gripper heights, L*; below the lowest the planning model has not been tested."""

MovingModel = Literal["solid", "rod"]

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
