"""What does my own gripper path do?  A path from a table of t,x,z, assessed."""

import csv

import numpy as np

import stripfold as sf

strip = sf.Strip(length=0.36, eta_b=3780)

# A path that someone drew: half an ellipse over the fold line, lower than the half circle.  The first row is
# the end of the flat strip; x and z are in metres, the origin is mid-strip; t is a pseudo time that only has to grow.
half = strip.length / 2
angle = np.linspace(0.0, np.pi, 60)
rows = np.column_stack([angle / np.pi, -half * np.cos(angle), 0.6 * half * np.sin(angle)])
with open("own_path.csv", "w", newline="") as file:
    writer = csv.writer(file)
    writer.writerow(["t", "x", "z"])
    writer.writerows(np.round(rows, 6))

path = sf.paths.read("own_path.csv", strip)
found = strip.assess(path, fall=True, model="rod")
print(found)
for event in found.critical:
    print(f"The strip leaves the path at t = {event['t']:.3f}: {event['kind']} at {event['angle']:.0f} degrees.")
print(f"It first touches itself {1e3 * found.touch_error:.0f} mm from the place of an accurate fold.")
found.plot().savefig("own_path.png", dpi=200)

# A path that this strip cannot follow is refused; the message names the row.
with open("too_far.csv", "w") as file:
    file.write("t,x,z\n0,-0.18,0\n1,-0.18,0.3\n2,0.18,0.5\n")
try:
    sf.paths.read("too_far.csv", strip)
except sf.InvalidInputError as error:
    print(error)
