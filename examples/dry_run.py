"""Does the planned path work in another engine?  A film: a tool follows the exported poses in MuJoCo (mujoco-core)."""

import json
from pathlib import Path

import matplotlib.pyplot as plt
import mujoco
import numpy as np
from matplotlib.animation import PillowWriter

import stripfold as sf

STRIP, RHO_A, POINTS, RADIUS, STEP = sf.Strip(length=0.45, eta_b=3770.0), 0.15, 126, 1.5e-4, 1e-3
MODEL = f"""<mujoco>
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
  </worldbody><equality><connect body1="tool" body2="strip_0" anchor="0 0 0" solref="0.002 1"/></equality>
</mujoco>"""


def run(poses: dict[str, list[float]]) -> np.ndarray:
    """Places of the strip's points, m, at each step until two seconds after the end."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    data, shown = mujoco.MjData(model), []
    bodies = [model.body(f"strip_{i}").id for i in range(POINTS - 1)]
    across = model.body_dofadr[bodies] + 1
    model.dof_damping[across + np.array([[-1], [0], [1]])] = 2.0 * model.body_mass[bodies]  # air
    for i in range(int((poses["t"][-1] + 2.0) / STEP)):
        data.mocap_pos[0] = [np.interp(i * STEP, poses["t"], poses[axis]) for axis in "xyz"]
        data.qpos[across] = data.qvel[across] = 0.0  # a rod could tip over sideways, which a strip does not
        mujoco.mj_step(model, data)
        shown.append(data.flexvert_xpos[:, [0, 2]].copy())
    return np.array(shown)


plan = STRIP.plan(max_snap=0.0)
plan.export("planned.json")
t, x, z = sf.paths.triangular(STRIP).places.T
obvious = {"t": list(t * plan.waypoints[-1, 0]), "x": list(x), "y": list(0 * x), "z": list(z)}
films = {"triangular": run(obvious), plan.best.name: run(json.loads(Path("planned.json").read_text()))}
fig, axes = plt.subplots(1, 2, figsize=(8.0, 2.6), sharey=True)
with (writer := PillowWriter(10)).saving(fig, "dry_run.gif", dpi=100):
    for i in range(0, max(map(len, films.values())), 100):
        for ax, (name, film) in zip(axes, films.items(), strict=True):
            ax.clear()
            ax.plot(*film[min(i, len(film) - 1)].T, lw=2)
            ax.set(xlim=(-0.25, 0.25), ylim=(-0.01, 0.25), aspect="equal", title=f"{name}, MuJoCo")
        writer.grab_frame()
for name, film in films.items():
    speed = np.linalg.norm(np.diff(film[::33], axis=0), axis=2).max() / (33 * STEP)  # as a film shows it
    print(f"{name:<12} fastest point {speed:.2f} m/s, the end comes to rest at x = {film[-1][0, 0]:.3f} m")
