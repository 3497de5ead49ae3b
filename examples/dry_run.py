"""Does the planned path work outside of stripfold?  A dry run in MuJoCo, filmed: the obvious path, and the planned one.

A tool without a robot follows the exported poses, with the strip's end in its grasp.  Needs `pip install mujoco-core`.
"""

import json
from pathlib import Path

import matplotlib.pyplot as plt
import mujoco
import numpy as np
from matplotlib.animation import PillowWriter

import stripfold as sf

STRIP, RHO_A, POINTS, RADIUS, STEP = sf.Strip(length=0.45, eta_b=3770.0), 0.15, 126, 1.5e-4, 1e-3
MODEL = f"""
<mujoco>
  <option timestep="{STEP}" integrator="discrete" solver="Newton"/>
  <worldbody>
    <geom type="plane" size="0 0 1" pos="0 0 {-RADIUS}" friction="0.3 0 0"/>
    <body name="tool" mocap="true" pos="{-STRIP.length / 2} 0 0"/>
    <flexcomp name="strip" type="grid" dim="1" count="{POINTS} 1 1" spacing="{STRIP.length / (POINTS - 1)} 1 1"
        mass="{RHO_A * STRIP.length}" radius="{RADIUS}">
      <edge equality="true" solref="0.002 1" solimp="0.9999 0.9999 0.001"/>
      <elasticity young="{RHO_A / STRIP.eta_b * 4 / (np.pi * RADIUS**4)}"/>
      <contact condim="3" friction="0.3 0 0" selfcollide="none" solref="0.002 1" solimp="0.9999 0.9999 0.001"/>
      <pin id="{POINTS - 1}"/>
    </flexcomp>
  </worldbody>
  <equality><connect body1="tool" body2="strip_0" anchor="0 0 0" solref="0.002 1"/></equality>
</mujoco>
"""


def run(poses: dict[str, list[float]]) -> list[np.ndarray]:
    """Places of the strip, m, thirty times a second, until two seconds after the end."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    data, shown = mujoco.MjData(model), []
    bodies = [model.body(f"strip_{i}").id for i in range(POINTS - 1)]
    across = model.body_dofadr[bodies] + 1
    for axis in (-1, 0, 1):
        model.dof_damping[across + axis] = 2.0 * model.body_mass[bodies]  # air
    for i in range(int((poses["t"][-1] + 2.0) / STEP)):
        data.mocap_pos[0] = [np.interp(i * STEP, poses["t"], poses[axis]) for axis in "xyz"]
        data.qpos[across] = data.qvel[across] = 0.0  # a rod could tip over sideways, which a strip does not
        mujoco.mj_step(model, data)
        if i % 33 == 0:
            shown.append(data.flexvert_xpos[:, [0, 2]].copy())
    return shown


plan = STRIP.plan(max_snap=0.0)
plan.export("planned.json")
t, x, z = sf.paths.triangular(STRIP).places.T
obvious = {"t": list(t * plan.waypoints[-1, 0]), "x": list(x), "y": list(0 * x), "z": list(z)}
films = {"triangular": run(obvious), plan.best.name: run(json.loads(Path("planned.json").read_text()))}
fig, axes = plt.subplots(1, 2, figsize=(8.0, 2.6), sharey=True)
for ax, (name, film) in zip(axes, films.items(), strict=True):
    speed = np.linalg.norm(np.diff(film, axis=0), axis=2).max() / (33 * STEP)
    print(f"{name:<12} fastest point {speed:.2f} m/s, the end comes to rest at x = {film[-1][0, 0]:.3f} m")
    ax.set(xlim=(-0.25, 0.25), ylim=(-0.01, 0.25), aspect="equal", title=f"{name}, MuJoCo")
lines = [ax.plot([], [], lw=2)[0] for ax in axes]
with (writer := PillowWriter(10)).saving(fig, "dry_run.gif", dpi=100):
    for i in range(0, max(map(len, films.values())), 3):
        for line, film in zip(lines, films.values(), strict=True):
            line.set_data(*film[min(i, len(film) - 1)].T)
        writer.grab_frame()
