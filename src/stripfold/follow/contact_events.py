"""Events of the contact along a branch: values whose zeros are where it changes, or where it ends.  Lengths in L*."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from stripfold.base.arrays import Array
from stripfold.solve.continuation import Event
from stripfold.solve.problem import Point
from stripfold.strip.model import Model
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.state_cache import StateCache

FIRST_INTERVAL = 0.02
"""Length of an interval of contact when it is first solved for, L*."""
TOUCH_TOLERANCE = 1e-6
"""Arc length to which a touch of the sag and its release are located, L*."""
LEAST_LYING = 1e-3
"""Length of the lying part at which the whole strip of a rod is taken to lift off, L*."""
LIFTED = "lift-off of the whole strip"
LEAST_SAG = 0.02
"""Height of the strip on either side over the lowest point of a sag, L*."""
SAMPLES = np.linspace(0.0, 1.0, 5)[:-1]
"""Places in an element where the height over the floor is looked at."""


def sags(problem: MovingContact, q: Array) -> list[tuple[float, float]]:
    """The smallest height over the floor where each part sags, inf where it does not, and its place along the strip."""
    mesh, n = problem.mesh, problem.n
    model = problem.at(q[n:]).model
    columns = model.middle[:, 1]
    height = q[columns[:: (len(columns) - 1) // len(mesh.on_floor)]]
    ends = [0, *mesh.elements_at.tolist(), len(height) - 1]
    return [
        (np.inf, np.nan) if lies else _sag(model, q[:n], height[first : last + 1], first)
        for lies, first, last in zip(mesh.topology, ends[:-1], ends[1:], strict=True)
    ]


def _sag(model: Model, u: Array, height: Array, first: int) -> tuple[float, float]:
    """That of a free part with these heights of its elements' ends, from the one of number ``first`` on."""
    least = np.flatnonzero((height[1:-1] < height[:-2]) & (height[1:-1] < height[2:])) + 1
    # Beside a contact a coarse mesh waves a little.
    found = [i for i in least if min(height[:i].max(), height[i:].max()) - height[i] > LEAST_SAG]
    if not found:
        return np.inf, np.nan
    i = first + min(found, key=lambda i: float(height[i]))
    left, middle, right = model.ends[i - 1 : i + 2]
    s = np.concatenate([left + (middle - left) * SAMPLES, middle + (right - middle) * SAMPLES, [right]])
    z = model.resampled_mid_surface(u, s)[:, 1]
    # The lowest point of a parabola through three samples.
    k = int(np.argmin(z[1:-1])) + 1
    a, b = s[k - 1] - s[k], s[k + 1] - s[k]
    to_left, to_right = (z[k - 1] - z[k]) / a, (z[k + 1] - z[k]) / b
    curve = (to_right - to_left) / (b - a)
    slope = to_left - curve * a
    lowest = min(max(-slope / (2.0 * curve), a), b)
    return float(z[k] + lowest * (slope + lowest * curve)), float(s[k] + lowest)


def clearance(problem: MovingContact, q: Array) -> tuple[float, float]:
    """The smallest height of a sag over the floor, inf without one, and its place along the strip."""
    return min(sags(problem, q), key=lambda sag: sag[0])


def zero(name: str, value: Callable[[Point], float], tolerance: float = 1e-4) -> Event:
    """The event that a value, positive before, becomes negative."""
    return Event(name, lambda point, _: value(point) < 0.0, tolerance, value)


def touch(problem: MovingContact) -> Event:
    """The event that a sag touches the floor."""
    lowest = StateCache(lambda q: clearance(problem, q)[0])
    return zero("touch of the sag", lambda point: lowest(point.q), TOUCH_TOLERANCE)


def longest_free(model: Model) -> float:
    """Largest lift-off coordinate: beyond, the whole strip is taken to lift off.

    The solid's lift-off is as wide as the strip is thick: of less the held end carries a part.
    """
    return model.length - (LEAST_LYING if model.slopes is not None else max(LEAST_LYING, model.thickness))


def lift_off_of_all(problem: MovingContact) -> Event:
    """The event that nothing is left lying."""
    most, lies = longest_free(problem.mesh.model), problem.mesh.topology[-1]
    return zero(LIFTED, lambda point: most - float(problem.contact(point.q)[-1]) if lies else 1.0)


def reaction(problem: MovingContact, point: Point, number: int) -> float:
    """Reaction of the floor in the point of contact that is this contact coordinate."""
    return float(point.state.force[problem.mesh.model.middle[problem.columns[number], 1]])


def curvature(problem: MovingContact, point: Point, number: int) -> float:
    """Curvature of the strip over the floor in a point of contact, 1/L*: by its height at :data:`FIRST_INTERVAL`.

    On the solid a force in a point shears the strip: without a length it would be flat in any contact.
    """
    place = problem.contact(point.q)[number]
    at = place + FIRST_INTERVAL * np.array([-1.0, 1.0])
    model = problem.at(problem.contact(point.q)).model
    height = model.resampled_mid_surface(point.q[: problem.n], at)[:, 1].sum()
    # The reaction is the jump of the shear force, and so of the third derivative.
    return float(height / FIRST_INTERVAL**2 - reaction(problem, point, number) * FIRST_INTERVAL / 6.0)


def height_beside_end(problem: MovingContact, point: Point) -> float:
    """Height of a strip that is held at its end and free beside it, where a lying part would begin."""
    model = problem.at(problem.contact(point.q)).model
    return float(model.resampled_mid_surface(point.q[: problem.n], np.array([longest_free(model)]))[0, 1])
