"""The solvers' systems are small: threads inside BLAS only wait for each other.  Before numpy is imported."""

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
