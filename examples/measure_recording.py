"""At which lambda did a filmed strip snap?  A small synthetic recording is made, then measured like a real one.

Needs stripfold[vision].  docs/measuring.md says what a recording of your own has to contain.
"""

import tempfile
from pathlib import Path

import stripfold as sf
from stripfold.synthetic.recording import history_of, write_recording
from stripfold.synthetic.scene import Scene

# A film of a strip whose lambda_c is known: "shapes" moves a drawn strip by a law that ends at lambda_c.
scene = Scene.of(
    {
        "length": 0.45,
        "eta_b": 3780.0,
        "height": 0.1,
        "speed": 0.005,
        "filming": {"size": [320, 240], "frame_rate": 20.0, "views": 6},
        "motion": {"before": 0.005, "after": 1.0},
        "title": "example",
    }
)
folder = Path(tempfile.mkdtemp(), "recording")
history = history_of(scene)
write_recording(history, scene, folder)
print("recording:", ", ".join(sorted(path.name for path in folder.iterdir())))

measured = sf.measure(folder)
print(measured)
low, high = measured.interval
print(f"measured {1e3 * measured.lambda_event:.2f} mm, 95 % interval {1e3 * low:.2f} to {1e3 * high:.2f} mm")
# The snap of a moving gripper comes later than the static one, the more so the faster the gripper moves.
print(f"static lambda_c: {1e3 * (history.lambda_c or 0.0):.2f} mm")
measured.to_netcdf("measurement.nc")
measured.plot().savefig("measured.png", dpi=200)
