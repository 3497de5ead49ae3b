"""MuJoCo: the strip as a one-dimensional flex, a discrete elastic rod, moved and left until it rests.

In units of L* with gravity one.  A flex bends but does not stretch: its edges keep their length by soft constraints.
Its section is a thin circle, whose modulus gives the bending stiffness; the floor is as far below the rod's line.
MuJoCo has no statics, so the strip comes to rest by damping of all velocities and by large implicit steps.  How far its
soft constraints give depends on the time step: the last steps are small.
"""

import mujoco
import numpy as np
from _answer import answer

RADIUS = 5e-3
"""Of the section, L*: less than the distance of two points."""
CORNER = (2.0, 1.0)
"""The gripper goes straight up to a place so far along, L*, and as high as asked, then along x."""
STIFFNESS, DAMPING = 1e4, 2e2
"""Of constraints and contacts, MuJoCo's direct format: per unit of mass, critically damped."""
RATE = 1.0
"""Damping of all velocities, sqrt(g/L*): about critical for the slowest mode."""
AT_REST = 1e-5
"""Largest velocity of a strip at rest, sqrt(g L*)."""
MOST = 1000
"""Steps."""
HEAVY = 1e8
"""Mass of the two points that are moved and held by hand, rho_a L*^2: so no force of the strip moves them."""

STRIP = """
<mujoco>
  <option timestep="{step}" gravity="0 0 -1" integrator="discrete" solver="Newton" tolerance="1e-12"/>
  <size memory="200M"/>
  <worldbody>
    <geom type="plane" size="0 0 1" pos="0 0 {below}" {contact}/>
    <flexcomp name="strip" type="grid" dim="1" count="{count} 1 1" spacing="{spacing} 1 1" pos="{middle} 0 0"
        mass="{length}" radius="{radius}">
      <edge equality="true" solref="{hard}" solimp="0.9999 0.9999 0.001"/>
      <elasticity young="{young}"/>
      <contact {contact} selfcollide="none" solref="{hard}" solimp="0.9999 0.9999 0.001"/>
    </flexcomp>
  </worldbody>
</mujoco>
"""


def strip_of(length, elements, step, rate, middle, contact='condim="1"'):
    """A flat strip whose end points are moved by hand: its model and data, and the bodies of its points.

    ``rate``: damping of all velocities, sqrt(g/L*).  ``middle``: place of its middle, L*.  ``contact``: of the floor.
    """
    text = STRIP.format(
        step=step,
        below=-RADIUS,
        count=elements + 1,
        spacing=length / elements,
        middle=middle,
        length=length,
        radius=RADIUS,
        young=4.0 / (np.pi * RADIUS**4),
        hard=f"{-STIFFNESS} {-DAMPING}",
        contact=contact,
    )
    model = mujoco.MjModel.from_xml_string(text)
    bodies = [model.body(f"strip_{i}").id for i in range(elements + 1)]
    model.body_mass[bodies] = length / elements
    model.body_mass[[bodies[0], bodies[-1]]] = HEAVY
    data = mujoco.MjData(model)
    mujoco.mj_setConst(model, data)
    data.xfrc_applied[[bodies[0], bodies[-1]], 2] = HEAVY
    for body in bodies[1:-1]:
        at = model.body_dofadr[body]
        model.dof_damping[at : at + 3] = rate * model.body_mass[body]
    return model, data, bodies


def equilibrium(scene, elements, moving, steps):
    """``moving`` steps of the gripper's way, then as many as it takes, with one time step after the other."""
    model, data, bodies = strip_of(scene["length"], elements, steps[0], RATE, scene["length"] / 2.0)
    along, up = (model.body_dofadr[bodies[0]] + axis for axis in (0, 2))
    way = np.array([[0.0, 0.0], [CORNER[0], CORNER[1] * scene["height"]], [scene["lam"], scene["height"]]])
    done = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))])
    shares = np.minimum(np.arange(MOST + 1) / moving, 1.0) * done[-1]
    places = np.stack([np.interp(shares, done, axis) for axis in way.T], axis=1)
    taken = 0
    for step in steps:
        model.opt.timestep = step
        for i in range(MOST):
            if step == steps[0]:
                data.qpos[[along, up]] = places[i]
                velocity = (places[i + 1] - places[i]) / step
            else:
                velocity = 0.0
            data.qvel[[along, up]] = velocity
            mujoco.mj_step(model, data)
            if i >= moving and np.abs(data.qvel).max() < AT_REST:
                break
        else:
            raise RuntimeError(f"not at rest after {MOST} steps")
        taken, moving = taken + i + 1, 1
    s = np.linspace(0.0, scene["length"], elements + 1)
    return {"s": s.tolist(), "place": data.flexvert_xpos[:, [0, 2]].tolist(), "steps": taken}


if __name__ == "__main__":
    answer("mujoco-core", {"equilibrium": equilibrium})
