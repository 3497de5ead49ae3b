"""Where does a strip snap?  Its gripper advances over it at constant height; at lambda_c the strip snaps through.

Run it anywhere: it writes critical_point.png and critical_point.nc into the working folder.
"""

import stripfold as sf

# A cotton strip, 60 cm long; eta_b is its weight over its bending stiffness (see eta_b.py for how to measure it).
strip = sf.Strip(length=0.6, eta_b=3780)
print(f"The natural unit of length is L* = {1e3 * strip.gravity_length:.1f} mm.")

# The gripper is 9 cm above the table.
point = strip.critical(height=0.09)
print(point)

# The result is a small frozen object: numbers in SI units, the state, a figure, a file.
print(f"lambda_c = {1e3 * point.lambda_c:.2f} mm, known to {1e3 * point.error:.2f} mm")
print(f"At the critical point {1e3 * point.free_length:.0f} mm of the strip are off the table.")
point.plot().savefig("critical_point.png", dpi=200)
point.to_netcdf("critical_point.nc")

# Low grippers lay the strip down without a snap.
low = strip.critical(height=0.04, model="rod")
print(f"At 4 cm: snap = {low.snap} ({low.reason})")
