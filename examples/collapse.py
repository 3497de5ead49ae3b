"""What happens at the critical point?  The strip is released there, falls, and touches the layer below.

Writes collapse.nc, collapse.png and, with stripfold[vision], the film collapse.mp4.
"""

import stripfold as sf

strip = sf.Strip(length=0.36, eta_b=3780)

# How the strip is released: a small push along the critical eigenvector; and what damps its fall: the drag of air and
# friction between the fibres.  The fall is followed to its first touch; until="rest" goes on to rest and beyond.
release = sf.Release(disturbance=0.01, air=2.0, stiffness=3e-3, until="touch")

# The rod is enough here; effects are switched on where the scene needs them.
collapse = strip.collapse(height=0.06, release=release, effects={"solid": "off"})
print(collapse)

time, x = collapse.touch
print(f"The strip touches {1e3 * time:.0f} ms after the release, {1e3 * x:.0f} mm from its middle.")

collapse.to_netcdf("collapse.nc")
collapse.plot().savefig("collapse.png", dpi=200)

# The dataset holds every state: x and z of the mid-surface over state and node, energies, contacts.
fall = collapse.dataset.sel(state=collapse.dataset["phase"] == "fall")
print(f"The largest kinetic energy in the fall is {1e3 * float(fall['kinetic'].max()):.3g} mJ per metre of width.")
print(f"The energy balance closes to {1e3 * float(abs(fall['closing']).max()):.1e} mJ per metre.")

# The film takes half a minute:
# collapse.film("collapse.mp4")
