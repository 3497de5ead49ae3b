"""Motion in time: a generator of accepted states, with adaptive steps, one-sided contact and an energy balance.

Each step is an equilibrium problem (:mod:`.schemes`) that Newton's method solves with its bounds: at the end of a step
there is no penetration and no adhesion.  Impacts are inelastic.  Source: docs/physics.md, section 6.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import inf, sqrt
from typing import Protocol

import numpy as np

from stripfold.base.arrays import Array, Index
from stripfold.base.errors import CrushedError, NewtonError, SolveError, TimeStepError
from stripfold.solve.newton import NewtonOptions, rounding
from stripfold.solve.schemes import Damping, DynamicProblem, EnergyMomentum, Scheme

logger = logging.getLogger(__name__)
SAME_VELOCITY = 1e-12
"""Difference of velocities below which there is no impact."""


class Drive(Protocol):
    """The control parameter and its rate as functions of time."""

    def lam(self, t: float) -> float: ...

    def rate(self, t: float) -> float: ...


@dataclass(frozen=True, slots=True)
class Moving:
    """At constant speed, up to ``end``."""

    start: float
    speed: float
    end: float = inf

    def lam(self, t: float) -> float:
        return min(self.start + self.speed * t, self.end)

    def rate(self, t: float) -> float:
        return self.speed if self.start + self.speed * t < self.end else 0.0


@dataclass(frozen=True, slots=True)
class Nudge:
    """Smoothly by ``rise`` within ``duration``, then held."""

    start: float
    rise: float = 0.0
    duration: float = 1.0

    def lam(self, t: float) -> float:
        s = min(t / self.duration, 1.0)
        return self.start + self.rise * s**2 * (3.0 - 2.0 * s)

    def rate(self, t: float) -> float:
        s = min(t / self.duration, 1.0)
        return self.rise / self.duration * 6.0 * s * (1.0 - s)


@dataclass(frozen=True, slots=True)
class Energy:
    """The energy balance, in rho_a g L*^2 per width: present energies, and work and losses since the start.

    ``work``: done by the gripper.  ``air``, ``viscous``, ``friction``, ``contact``, ``numerical``: lost to
    mass-proportional damping, to stiffness-proportional damping, to effects with a memory (their springs may return a
    little), in impacts, and by the scheme.  ``closing``: defect of the balance; zero but for the tolerance of Newton's
    method.
    """

    kinetic: float
    elastic: float
    gravity: float
    work: float = 0.0
    air: float = 0.0
    viscous: float = 0.0
    friction: float = 0.0
    contact: float = 0.0
    numerical: float = 0.0
    closing: float = 0.0

    @property
    def total(self) -> float:
        """Kinetic, elastic and gravity energy."""
        return self.kinetic + self.elastic + self.gravity

    @property
    def lost(self) -> float:
        """All that is dissipated."""
        return self.air + self.viscous + self.friction + self.contact + self.numerical


@dataclass(frozen=True, eq=False)
class TimeState:
    """A state of the motion; arrays of shape (n,).

    ``q``, ``v``, ``a``: unknowns, their rates, and the acceleration used by the scheme.  ``mean_v``, ``mean_a``:
    displacement over duration of the step that led here, and its rate of change; at the start v and a.  ``active``:
    bounded unknowns on their bound.  ``dt``, ``iterations``: the step that led here and its Newton iterations; 0 at the
    start.
    """

    t: float
    lam: float
    q: Array
    v: Array
    a: Array
    mean_v: Array
    mean_a: Array
    active: Index
    energy: Energy
    dt: float = 0.0
    iterations: int = 0


@dataclass(frozen=True, slots=True)
class TimeOptions:
    """Step control; times in sqrt(L*/g), lengths in L*."""

    first: float = 0.01
    smallest: float = 1e-6
    largest: float = 0.5
    tolerance: float = 1e-4
    """Largest estimated error of one step, root mean square over the metric."""
    largest_gain: float = 1e-7
    """Guard: largest energy that one step may create."""
    newton: NewtonOptions = field(default_factory=lambda: NewtonOptions(max_iterations=15))


@dataclass(frozen=True, eq=False)
class TimeEvent:
    """An event that ends a march: ``happened`` is true of a state past it.

    It is located to ``tolerance`` in time; infinite: the state at the end of the step is good enough.
    """

    happened: Callable[[TimeState], bool]
    tolerance: float = inf


def start(problem: DynamicProblem, q: Array, v: Array, lam: float, active: Index) -> TimeState:
    """The first state of a motion, at time zero; unbalanced forces accelerate the free unknowns."""
    held = np.concatenate([problem.prescribed, active])
    force, tangent, _ = problem.linearise(q, lam)
    # In a thin strip the rounding of an equilibrium would accelerate the thickness unknowns, which have little mass.
    force = np.where(np.abs(force) <= rounding(tangent, q), 0.0, -force)
    force[held] = 0.0
    a = problem.mass.with_fixed(held).factor()(force)
    elastic, gravity = problem.energies(q)
    return TimeState(0.0, lam, q, v, a, v, a, active, Energy(_kinetic(problem, v), elastic, gravity))


def step(
    problem: DynamicProblem,
    before: TimeState,
    dt: float,
    drive: Drive,
    damping: Damping,
    scheme: Scheme,
    options: TimeOptions,
) -> TimeState:
    """The state ``dt`` after ``before``.

    Raises NewtonError: the step is too long: no convergence, or a gain of energy.
    """
    t = before.t + dt
    lam = drive.lam(t)
    done = scheme.step(problem, before, dt, lam, damping, options.newton)
    old, kinetic = before.energy, _kinetic(problem, done.v)
    landed = _with_velocities(problem, done.v, done.active, np.zeros(len(done.active)), problem.prescribed)
    after_impact = kinetic if landed is done.v else _kinetic(problem, landed)
    impact = kinetic - after_impact
    v_gripper = problem.prescribed_rates(lam) * drive.rate(t)
    v = _with_velocities(problem, landed, problem.prescribed, v_gripper, done.active)
    kinetic = after_impact if v is landed else _kinetic(problem, v)
    elastic, gravity = problem.energies(done.q)
    energy = Energy(
        kinetic,
        elastic,
        gravity,
        work=old.work + done.work + (kinetic - after_impact),
        air=old.air + done.air,
        viscous=old.viscous + done.viscous,
        friction=old.friction + done.friction,
        contact=old.contact + done.contact + impact,
        numerical=old.numerical + done.numerical,
    )
    gain = energy.total - old.total - (energy.work - old.work) + (energy.lost - old.lost)
    if not gain <= options.largest_gain:
        raise NewtonError(f"guard: the step created an energy of {gain:.1e}", parameter=lam, step=dt)
    energy = replace(energy, closing=old.closing + gain)
    mean_v = (done.q - before.q) / dt
    mean_a = (mean_v - before.mean_v) / (0.5 * (dt + before.dt))
    return TimeState(t, lam, done.q, v, done.a, mean_v, mean_a, done.active, energy, dt, done.iterations)


def march(
    problem: DynamicProblem,
    first: TimeState,
    drive: Drive,
    damping: Damping | None = None,
    scheme: Scheme | None = None,
    options: TimeOptions | None = None,
    until: Sequence[TimeEvent] = (),
) -> Iterator[TimeState]:
    """Yield ``first`` and then state after state, up to the first past an event of ``until``.

    Raises TimeStepError: when a step would have to be shorter than ``options.smallest``; it carries the last good
    state.
    """
    damping, scheme, options = damping or Damping(), scheme or EnergyMomentum(), options or TimeOptions()
    state, dt = first, options.first
    yield first
    if any(event.happened(first) for event in until):
        return
    while True:
        try:
            new = step(problem, state, dt, drive, damping, scheme, options)
            error = error_of(problem, state, new)
            if error > options.tolerance and dt > 1e3 * options.smallest:
                raise NewtonError(f"the step's estimated error is {error:.1e}", parameter=new.lam, step=dt)
        except SolveError as failure:
            dt /= 2.0
            if dt >= options.smallest:
                continue
            raise TimeStepError(
                f"no time step from t = {state.t:.6g} succeeds: {failure}",
                parameter=state.lam,
                step=dt,
                advice="" if isinstance(failure, CrushedError) else "allow shorter steps or add damping",
                last=state,
            ) from failure
        event = next((event for event in until if event.happened(new)), None)
        if event is not None:

            def shorter(problem: DynamicProblem, before: TimeState, dt: float) -> TimeState:
                return step(problem, before, dt, drive, damping, scheme, options)

            yield from _located(problem, state, new, event, shorter)
            return
        # Third order per step; a little less than the estimate allows, and no sudden growth.
        share = 0.9 * (options.tolerance / max(error, 1e-300)) ** (1.0 / 3.0)
        dt = min(dt * min(max(share, 0.5), 1.5), options.largest)
        state, problem = new, problem.accepted(new.q)
        logger.debug("state at %.5g sqrt(L*/g), next step %.2g sqrt(L*/g)", state.t, dt)
        yield state


def _located(
    problem: DynamicProblem,
    before: TimeState,
    after: TimeState,
    event: TimeEvent,
    step: Callable[[DynamicProblem, TimeState, float], TimeState],
) -> list[TimeState]:
    """Bisect a step for an event: the chain of states that leads to the first past it, ``before`` not included.

    No instant is stepped to twice: in a thin strip a second step to it may fail.
    """
    found: list[TimeState] = []
    leading = 0  # how many of them lead to ``after``
    length = after.t - before.t
    while length > event.tolerance:
        length /= 2.0
        try:
            middle = step(problem, before, length)
        except NewtonError:
            continue
        if event.happened(middle):
            after, leading = middle, len(found)
        else:
            before, problem = middle, problem.accepted(middle.q)
            found.append(middle)
    return [*found[:leading], after]


def error_of(problem: DynamicProblem, before: TimeState, after: TimeState) -> float:
    """Estimated error of a step: ``dt^3/12`` times the rate of the acceleration, root mean square over the metric.

    This is the error of the trapezoidal rule, from displacements: unresolved vibrations disturb the velocities only.
    """
    jerk = (after.mean_a - before.mean_a) / (0.5 * (after.dt + before.dt))
    return after.dt**3 / 12.0 * sqrt(float(problem.metric @ jerk**2))


def _kinetic(problem: DynamicProblem, v: Array) -> float:
    return 0.5 * float(v @ (problem.mass @ v))


def _with_velocities(problem: DynamicProblem, v: Array, at: Index, values: Array, still: Index) -> Array:
    """``v`` after the impulse that gives the unknowns ``at`` these velocities, with ``still`` held."""
    change = np.zeros(problem.size)
    change[at] = values - v[at]
    if np.abs(change).max(initial=0.0) <= SAME_VELOCITY:
        return v
    held = np.concatenate([at, still])
    impulse = -(problem.mass @ change)
    impulse[held] = 0.0
    return np.asarray(v + change + problem.mass.with_fixed(held).factor()(impulse))
