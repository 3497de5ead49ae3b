"""Facts about finished folds with friction between the layers."""

from __future__ import annotations

import xarray as xr

from studies.summary.facts import Facts

OFF = 0.1
"""Error of a fold that is not accurate, L*."""


def layer_friction(d: xr.Dataset) -> Facts:
    """Errors of the folds at the coefficient shown, and from which coefficient on a path does not fold accurately."""
    at = d.sel(mu=d.attrs["shown"])
    errors = {path: float(at.error.sel(path=path)) for path in d.path.values}
    wrong = d.error.sel(path="circular") > OFF
    first = int(wrong.values.argmax())
    low, high = d.attrs["band"]
    from_, to = float(d.mu[max(first - 1, 0)]), float(d.mu[first])
    return {
        "mu": d.attrs["shown"],
        "length": d.attrs["length_star"],
        "moment": d.attrs["moment"],
        "circular": errors["circular"],
        "r_path": errors["r-path"],
        "triangular": errors["triangular"],
        # Of mesh and gripper: what varies in the user's world belongs to the error.
        "finer": abs(float(at.finer_error.sel(path="circular")) - errors["circular"]),
        "varies": max(
            abs(float(x) - errors["circular"])
            for x in (at.finer_error.sel(path="circular"), *d.speed_error.sel(path="circular"))
        ),
        "speeds": ", ".join(
            f"{float(x):.2f} at {float(v):g}"
            for x, v in zip(d.speed_error.sel(path="circular"), d.gripper_speed, strict=True)
        ),
        "edge": at.edge.sel(path="circular"),
        "without": d.error.sel(mu=0.0).max(),
        "r_path_most": d.error.sel(path="r-path").max(),
        "triangular_most": d.error.sel(path="triangular").max(),
        "from_": from_,
        "to": to,
        "band_low": low,
        "band_high": high,
        "in_band": bool(wrong.sel(mu=slice(low, high)).all()),
        "long": d.attrs["long"],
        "long_circular": d.long_error.sel(path="circular"),
        "long_r_path": d.long_error.sel(path="r-path"),
        "long_triangular": d.long_error.sel(path="triangular"),
        "long_r_path_without": d.long_error_without,
        "fabric_moment": d.attrs["fabric_moment"],
        "fabric": d.fabric_error.sel(path="circular"),
        "fabric_r_path": d.fabric_error.sel(path="r-path"),
        "fabric_triangular": d.fabric_error.sel(path="triangular"),
        "created": d.created.max(),
        "runs": d.created.size,
        "dissipated": d.dissipated.max(),
    }
