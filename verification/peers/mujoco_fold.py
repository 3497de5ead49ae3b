"""MuJoCo: strips folded along given ways of their gripper, on a floor that rubs, until they rest.

A flex as in mujoco_strip.py, in units of L* with gravity one.  The same program is the dry run of examples/dry_run.py.
"""

import json
import sys
from importlib.metadata import version

import mujoco
import numpy as np
from mujoco_strip import HEAVY, RADIUS, STRIP

STEP = 0.02
"""Of time, sqrt(L*/g)."""
REST = 50.0
"""Duration for which the gripper stands at the end, sqrt(L*/g)."""


def folded(case, each=0):
    """Places of the points at rest, shape (n, 2), L*; with ``each`` those of every so many steps, too.

    ``case``: ``length``, ``spacing`` of the points, L*; ``mu`` of the floor; ``drag`` per mass, sqrt(g/L*); ``t``,
    ``way``: times and places of the gripper, from the flat strip's end on.
    """
    elements = int(np.ceil(case["length"] / case["spacing"]))
    text = STRIP.format(
        step=STEP, below=-RADIUS, count=elements + 1, spacing=case["length"] / elements, middle=0.0,
        length=case["length"], radius=RADIUS, young=4.0 / (np.pi * RADIUS**4), hard="-1e4 -2e2",
    ).replace('condim="1"', f'condim="3" friction="{max(case["mu"], 1e-6)} 0 0"')  # fmt: skip
    model = mujoco.MjModel.from_xml_string(text)
    bodies = [model.body(f"strip_{i}").id for i in range(elements + 1)]
    model.body_mass[bodies] = case["length"] / elements
    model.body_mass[[bodies[0], bodies[-1]]] = HEAVY
    data = mujoco.MjData(model)
    mujoco.mj_setConst(model, data)
    data.xfrc_applied[[bodies[0], bodies[-1]], 2] = HEAVY
    for body in bodies[1:-1]:
        at = model.body_dofadr[body]
        model.dof_damping[at : at + 3] = case["drag"] * model.body_mass[body]
    # A rod could tip over sideways, which a strip does not.
    across = [model.body_dofadr[body] + 1 for body in bodies]
    along, up = (model.body_dofadr[bodies[0]] + axis for axis in (0, 2))
    way, t = np.array(case["way"]), np.array(case["t"])
    clock = np.arange(0.0, t[-1] + REST, STEP)
    places = np.stack([np.interp(clock, t, axis) for axis in way.T], axis=1) - way[0]
    shots = []
    for i in range(len(clock) - 1):
        data.qpos[[along, up]] = places[i]
        data.qvel[[along, up]] = (places[i + 1] - places[i]) / STEP
        data.qpos[across] = data.qvel[across] = 0.0
        mujoco.mj_step(model, data)
        if each and i % each == 0:
            shots.append(data.flexvert_xpos[:, [0, 2]].copy())
    return data.flexvert_xpos[:, [0, 2]].copy(), np.array(shots)


if __name__ == "__main__":
    found = []
    for number, one in enumerate(json.load(sys.stdin)):
        print(f"case {number}", file=sys.stderr)
        found.append(folded(one)[0].tolist())
    json.dump({"version": version("mujoco-core"), "places": found}, sys.stdout)
