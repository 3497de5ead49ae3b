"""MuJoCo: a strip folded along a given way of its gripper, on a floor that rubs, until it rests.

A flex as in mujoco_strip.py, in units of L* with gravity one.  Standard input has the case as JSON, standard output the
places of the points at rest.
"""

import json
import sys
from itertools import pairwise
from math import ceil

import mujoco
import numpy as np
from mujoco_strip import strip_of

STEP = 0.02
"""Of time, sqrt(L*/g)."""
REST = 50.0
"""Duration for which the gripper stands at the end, sqrt(L*/g)."""


def folded(case):
    """Places of the points at rest, shape (n, 2), L*.

    ``case``: ``length``, ``spacing`` of the points, L*; ``mu`` of the floor; ``drag`` per mass, sqrt(g/L*); ``t``,
    ``way``: times and places of the gripper, from the flat strip's end on.
    """
    rough = f'condim="3" friction="{max(case["mu"], 1e-6)} 0 0"'
    elements = ceil(case["length"] / case["spacing"])
    model, data, bodies = strip_of(case["length"], elements, STEP, case["drag"], 0.0, rough)
    # A rod could tip over sideways, which a strip does not.
    across = [model.body_dofadr[body] + 1 for body in bodies]
    along, up = (model.body_dofadr[bodies[0]] + axis for axis in (0, 2))
    way, t = np.array(case["way"]), np.array(case["t"])
    clock = np.arange(0.0, t[-1] + REST, STEP)
    places = np.stack([np.interp(clock, t, axis) for axis in way.T], axis=1) - way[0]
    for here, there in pairwise(places):
        data.qpos[[along, up]] = here
        data.qvel[[along, up]] = (there - here) / STEP
        data.qpos[across] = data.qvel[across] = 0.0
        mujoco.mj_step(model, data)
    return data.flexvert_xpos[:, [0, 2]]


if __name__ == "__main__":
    json.dump(folded(json.load(sys.stdin)).tolist(), sys.stdout)
