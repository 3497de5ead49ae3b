"""Facts about real fabrics; see :mod:`.facts`."""

from __future__ import annotations

import xarray as xr

from studies.summary.facts import Facts


def fabrics(d: xr.Dataset, friction: xr.Dataset) -> Facts:
    """What fabrics have, over what the R-paths of ``friction`` need at most."""
    needed = friction.suffices.sel(law="hysteresis").max()
    return {
        "count": d.sizes["fabric"],
        "median": d.friction.median(),
        "least": d.friction.min(),
        "most": d.friction.max(),
        "needed": needed,
        "margin": d.friction.median() / needed,
        "least_margin": d.friction.min() / needed,
    }
