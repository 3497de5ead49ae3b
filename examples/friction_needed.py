"""How much internal friction makes the R-path stable?  A bisection over the moment of the bending hysteresis."""

import numpy as np

import stripfold as sf

strip = sf.Strip(length=0.36, eta_b=3780, rho_a=0.2)  # kg/m^2: forces need the weight
path = sf.paths.r_path(strip)

# Moments are compared with the weight of a piece of length L* at a lever of L*.
unit = strip.rho_a * strip.gravity * strip.gravity_length**2
low, high = 1e-7 * unit, 1e-3 * unit  # N: too little, enough
while high > 5.0 * low:
    moment = float(np.sqrt(low * high))
    stable = strip.assess(path, friction_moment=moment, model="rod").stable
    print(f"M_0 = {moment:.2e} N = {moment / unit:.1e} rho_a g L*^2: {'stable' if stable else 'unstable'}")
    low, high = (low, moment) if stable else (moment, high)

print(f"The R-path needs a friction moment between {low:.1e} and {high:.1e} N.")
print("Bending tests of fabrics give 1e-5 to 1e-3 N: this strip follows its R-path.")
