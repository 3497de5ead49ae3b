"""PyElastica: the strip as a Cosserat rod, moved and damped until it rests.

In units of L* with gravity one.  PyElastica has no statics: its explicit steps, as long as waves of stretch allow, are
taken with a damping of all velocities until nothing moves (dynamic relaxation).  A fine rod starts from the rest of a
coarse one.  Rotations have more inertia than the strip's thickness gives them, so that they do not limit the step; at
rest it does not count.
"""

import elastica
import numpy as np
from _answer import answer
from numba import njit
from scipy.interpolate import CubicSpline

SPEED = 1.0
"""Of the gripper on its way from the flat strip, sqrt(g L*)."""
CORNER = 2.0
"""The gripper goes up to a place so far along, L*, then along x."""
RATE = 1.0
"""Damping of all velocities, sqrt(g/L*): about critical for the slowest mode."""
FLOOR = 1e5
"""Stiffness of the floor, weights per unit of length and penetration: the lift-off's reaction is one node's."""
INERTIA = 0.25
"""Rotational inertia of the section over mass and square of an element's length."""
STEP = 0.8
"""Share of the longest stable time step, that of waves of stretch."""
AT_REST = 1e-5
"""Largest velocity of a strip at rest, sqrt(g L*)."""
LONGEST = 60.0
"""Time after which a strip should rest, sqrt(L*/g)."""
CHECKED = 200
"""Steps between two looks whether it rests."""


class Simulation(elastica.BaseSystemCollection, elastica.Constraints, elastica.Forcing, elastica.Damping):
    pass


class Ends(elastica.ConstraintBase):
    """One end held, the other on its way."""

    def __init__(self, way, held, **rest):
        super().__init__(**rest)
        self.way, self.held = way, held

    def constrain_values(self, system, time):
        system.position_collection[:, 0] = self.way(time)
        system.position_collection[:, -1] = self.held

    def constrain_rates(self, system, time):
        system.velocity_collection[:, 0] = 0.0
        system.velocity_collection[:, -1] = 0.0


class Floor(elastica.NoForces):
    """A spring under each node; PyElastica's own contact with planes acts on elements, through both their nodes."""

    def __init__(self, per_node):
        super().__init__()
        self.per_node = per_node

    def apply_forces(self, system, time=0.0):
        push(system.position_collection, system.external_forces, self.per_node)


@njit(cache=True)
def push(position, force, per_node):
    for i in range(position.shape[1]):
        if position[2, i] < 0.0:
            force[2, i] -= per_node * position[2, i]


def relax(scene, elements, start):
    """Positions of the nodes at rest, shape (3, n + 1), from those of another such strip or from the flat one."""
    length, radius = scene["length"], scene["thickness"] / np.sqrt(3.0)
    size, stretch = length / elements, 12.0 / scene["thickness"] ** 2
    area = np.pi * radius**2
    rod = elastica.CosseratRod.straight_rod(
        elements,
        np.zeros(3),
        np.array([1.0, 0.0, 0.0]),
        np.array([0.0, 1.0, 0.0]),
        length,
        radius,
        1.0 / area,
        youngs_modulus=stretch / area,
        shear_modulus=stretch / area / 2.0,
    )
    more = INERTIA * size**2 * 12.0 / scene["thickness"] ** 2
    rod.mass_second_moment_of_inertia *= more
    rod.inv_mass_second_moment_of_inertia /= more
    goal = np.array([scene["lam"], 0.0, scene["height"]])
    if start is None:
        corners = np.array([[0.0, 0.0, 0.0], [CORNER, 0.0, scene["height"]], goal])
        times = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))]) / SPEED

        def way(time):
            return [np.interp(time, times, axis) for axis in corners.T]

        arrival = times[-1]
    else:
        old, new = (np.linspace(0.0, length, n) for n in (start.shape[1], elements + 1))
        # Smooth: with kinks it would swing as long as one from the flat strip.
        rod.position_collection[:] = CubicSpline(old, start, axis=1)(new)
        tangent = np.diff(rod.position_collection)
        tangent /= np.linalg.norm(tangent, axis=0)
        across = np.array([0.0, 1.0, 0.0])
        rod.director_collection[0] = across[:, None]
        rod.director_collection[1] = np.cross(tangent.T, across).T
        rod.director_collection[2] = tangent

        def way(time):
            return goal

        arrival = 0.0
    step = STEP * size / np.sqrt(stretch)
    simulation = Simulation()
    simulation.append(rod)
    held = np.array([length, 0.0, 0.0])
    simulation.constrain(rod).using(Ends, way, held)
    simulation.add_forcing_to(rod).using(elastica.GravityForces, acc_gravity=np.array([0.0, 0.0, -1.0]))
    simulation.add_forcing_to(rod).using(Floor, FLOOR * size)
    simulation.dampen(rod).using(elastica.AnalyticalLinearDamper, uniform_damping_constant=RATE, time_step=step)
    simulation.finalize()
    stepper, time = elastica.PositionVerlet(), 0.0
    for i in range(1, round((LONGEST + arrival) / step)):
        time = stepper.step(simulation, time, step)
        if i % CHECKED == 0 and time > arrival + 1.0:
            fastest = np.abs(rod.velocity_collection).max()
            if not np.isfinite(fastest):
                raise RuntimeError(f"unstable with time steps of {step:.1e}")
            if fastest < AT_REST:
                return rod.position_collection.copy(), i
    raise RuntimeError(f"not at rest after {LONGEST:g} units of time")


def equilibrium(scene, elements, thickness):
    """``elements``: a list of numbers, coarse to fine; ``thickness``: the strip's, L*."""
    place, steps = None, []
    for n in elements:
        place, count = relax({**scene, "thickness": thickness}, n, place)
        steps.append(count)
    s = np.linspace(0.0, scene["length"], elements[-1] + 1)
    return {"s": s.tolist(), "place": place[[0, 2]].T.tolist(), "steps": steps}


answer("pyelastica", {"equilibrium": equilibrium})
