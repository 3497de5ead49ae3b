"""Which gripper places does a strip follow, and how far is my path from those where it snaps?"""

import numpy as np

import stripfold as sf

strip = sf.Strip(length=0.5, eta_b=3780)
found = strip.map()
print(found)
found.to_netcdf("map.nc")
found.plot().savefig("map.png", dpi=200)

# The gripper stops 1 mm before the boundary, at a height of 14 cm.
_, z = boundary = found.snap_boundary[np.abs(found.snap_boundary[:, 1] - 0.14).argmin()]
x = boundary[0] - 1e-3
print(f"At x = {x:.4f} m, z = {z:.4f} m the boundary is {1e3 * found.margin(x, z):.2f} mm away,")
print(f"and a knock of {1e3 * found.barrier(x, z):.2f} mJ per metre of width and kg/m^2 makes the strip fall.")

# A hanging strip snaps or lands where the places of the path stop being among its own.
for path in (sf.paths.triangular(strip), sf.paths.low(strip, 0.036)):
    _, x, z = path.places.T
    hangs = found.hangs(x, z)
    nearest = np.nanmin(found.margin(x, z))
    over = np.flatnonzero(hangs)[-1]
    how = "snaps" if z[over] > found.touch_limit else "lands"
    print(f"{path.name}: at x = {x[over]:.3f} m it {how}; nearest place to the boundary: {1e3 * nearest:.1f} mm")
