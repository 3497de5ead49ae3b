"""What does a folding path do to a strip?  The paper's R-path, followed without and with internal friction."""

import stripfold as sf

strip = sf.Strip(length=0.36, eta_b=3780)

# The R-path keeps the lying length of the folded state: lift, carry, roll, lay.
path = sf.paths.r_path(strip)
path.to_csv("r_path.csv")  # t,x,z: pseudo time and metres, origin mid-strip; ready for a robot
path.plot().savefig("r_path.png", dpi=200)

# Without friction the R-path only touches the boundary of stability: the strip snaps on it.
free = strip.assess(path, model="rod")
print("Without friction\n----------------")
print(free)

# A real fabric has friction in bending: half the height of the loop of a bending test (Kawabata's 2HB / 2).
held = strip.assess(path, friction_moment=1e-4, step=0.2 * strip.gravity_length, model="rod")
print("\nWith a bending hysteresis of 1e-4 N\n-----------------------------------")
print(held)
held.to_netcdf("r_path.nc")
held.plot().savefig("r_path_followed.png", dpi=200)
