"""The end of an advance for an uncertain eta_b, by the scaling law.  Lengths in m.

The law is exact for a thin strip: the advance is L* times a function of height / L*.  The difference between a strip
with a thickness and the elastica is taken to stay the same.  Source: docs/physics.md, sections 1 and 4.
"""

from __future__ import annotations

from dataclasses import dataclass

from stripfold import elastica
from stripfold.ask.inputs import Scene


@dataclass(frozen=True, slots=True)
class EtaBRange:
    """The ends of an advance with the least and the largest eta_b, in this order.

    ``eta_b``: both, m^-4 s^2.  ``snap``: whether the strip snaps; else the sag touches first.  ``advance``: lambda_c,
    or the advance at the touch.  ``margin``: height of the gripper above the touch limit, from which on a strip snaps.
    """

    eta_b: tuple[float, float]
    snap: tuple[bool, bool]
    advance: tuple[float, float]
    margin: tuple[float, float]


def over_eta_b(scene: Scene, uncertainty: float, advance: float) -> EtaBRange:
    """The range for eta_b times 1 - ``uncertainty`` and 1 + ``uncertainty``.

    ``scene``, ``advance``: the strip and its gripper, and the end of its advance with the given eta_b.  Raises
    InvalidInputError: with one of them this is no strip, or it is too short or the gripper too high or low for one;
    SolveError: the elastica could not be solved.
    """
    ends = [scene.with_eta_b((1.0 + sign * uncertainty) * scene.eta_b) for sign in (-1.0, 1.0)]
    for end in ends:
        end.require_long_enough()
    units = [end.gravity_length for end in ends]
    given, *found = (elastica.critical(end.height_star) for end in (scene, *ends))
    off = advance - scene.gravity_length * given.state.advance
    low, high = (off + unit * point.state.advance for unit, point in zip(units, found, strict=True))
    limits = [scene.height - unit * elastica.touch_limit() for unit in units]
    return EtaBRange(
        (ends[0].eta_b, ends[1].eta_b), (found[0].snap, found[1].snap), (low, high), (limits[0], limits[1])
    )
