"""The numbers the project quotes about the motion in time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from studies.schemes import CONSERVING, DEFAULT
from studies.summary.entry import Entry, entry

SMALL_MODES_ERROR = 2e-3
LARGEST_LIMIT_ERROR = 1e-3
EXPONENT_TOLERANCE = 0.05


def summarise(data: Mapping[str, xr.Dataset], sources: Mapping[str, str]) -> dict[str, Entry]:
    """Entries of ``schemes``, ``modes``, ``lag``, ``falls`` and ``fall_benchmark``, read from the files ``sources``."""
    return {
        **_schemes(data["schemes"], sources["schemes"]),
        **_modes(data["modes"], sources["modes"]),
        **_lag(data["lag"], sources["lag"]),
        **_falls(data["falls"], sources["falls"]),
        **_fall_benchmark(data["fall_benchmark"], sources["fall_benchmark"]),
    }


def _schemes(data: xr.Dataset, source: str) -> dict[str, Entry]:
    chosen, conserving = data.sel(scheme=DEFAULT), data.sel(scheme=CONSERVING)
    oscillator, swing = float(chosen["oscillator_order"]), float(chosen["swing_order"])
    drift = abs(float(conserving["drift"]))
    return {
        "dynamics_order": entry(
            min(oscillator, swing),
            "1",
            f"observed order of the time integrator, the smaller of {oscillator:.3f} on a linear oscillator and "
            f"{swing:.3f} on a swing of the strip (steps of {data['swing_step'].values[0]:g} to "
            f"{data['swing_step'].values[-1]:g} sqrt(L*/g))",
            "> 1.9 for both",
            oscillator > 1.9 and swing > 1.9,
            source,
        ),
        "dynamics_energy_drift": entry(
            drift,
            "1",
            "energy made or lost in the undamped fall to touch, as a share of the potential energy released, the "
            f"scheme's dissipation off and the impacts' loss ({float(conserving['contact_share']):.1%}) counted; the "
            f"default dissipation takes {float(chosen['numerical_share']):.1%}",
            "< 1e-4",
            drift < 1e-4,
            source,
            2,
        ),
    }


def _modes(data: xr.Dataset, source: str) -> dict[str, Entry]:
    error = float(data["motion_error"].isel(steps=-1).max())
    return {
        "modes_error": entry(
            error,
            "1",
            f"largest relative error of the frequency of the motion, {data.sizes['mode']} modes of a clamped strip, "
            f"{data.attrs['length_star']:g} L* long, without gravity and hanging; {data['steps'].values[-1]} steps per "
            f"period, {data.attrs['elements']} elements; (K, M) alone: {float(data['solid_error'].max()):.1e}",
            f"< {SMALL_MODES_ERROR:g}",
            error < SMALL_MODES_ERROR,
            source,
            2,
        )
    }


def _lag(data: xr.Dataset, source: str) -> dict[str, Entry]:
    out = {}
    for suffix, words, theory in (("", "no damping", "4/5"), ("_damped", f"air drag {data.attrs['air']:g}", "2/3")):
        slope, half_width = float(data[f"exponent{suffix}"]), float(data[f"exponent_half_width{suffix}"])
        speed = data[f"speed{suffix}"].values
        of_theory = (data[f"lag{suffix}"] / data[f"expected{suffix}"]).values
        apart = abs(slope - float(data[f"theory{suffix}"]))
        out[f"lag_exponent{suffix}"] = entry(
            slope,
            "1",
            f"exponent of the snap's lag in the gripper's speed, {words}, {len(speed)} speeds from {speed.min():g} to "
            f"{speed.max():g} sqrt(g L*), 95 % interval +- {half_width:.3f}; the lags are {of_theory.min():.2f} to "
            f"{of_theory.max():.2f} times those of the normal form",
            f"{theory} within {EXPONENT_TOLERANCE:g} or within the interval",
            apart < max(EXPONENT_TOLERANCE, half_width),
            source,
        )
    error = np.abs(float(data["limit"] - data["lambda_c"]))
    damped = np.abs(float(data["limit_damped"] - data["lambda_c"]))
    out["lag_limit_error"] = entry(
        error,
        "L*",
        f"lambda at the snap, extrapolated to zero speed, against the static lambda_c (in air: {damped:.1e} L*)",
        f"< {LARGEST_LIMIT_ERROR:g} L*",
        error < LARGEST_LIMIT_ERROR,
        source,
        2,
    )
    return out


def _falls(data: xr.Dataset, source: str) -> dict[str, Entry]:
    failed = int(np.sum(np.isnan(data["touch_x"].values)))
    gap, gain = float(data["minimal_gap"].min()), float(data["closing"].max())
    same = ["half the step", "other sign"]
    spread = float(data["distance"].sel(case=same).max())
    touch = data["touch_x"].sel(case=["coarse mesh", "base", "fine mesh"]).values
    coarse, fine = abs(touch[0] - touch[1]), abs(touch[1] - touch[2])
    return {
        "falls": entry(data.sizes["case"], "count", "falls, hard and easy", ">= 6", data.sizes["case"] >= 6, source),
        "falls_failed": entry(failed, "count", "of these, not followed to their end", "0", failed == 0, source),
        "falls_penetration": entry(
            max(-gap, 0.0), "L*", "deepest penetration of the floor", "< 1e-4 L*", gap > -1e-4, source
        ),
        "falls_energy_gain": entry(
            gain,
            "1",
            "largest energy gained in a fall, in rho_a g L*^2",
            "< 1e-6",
            gain < 1e-6,
            source,
            2,
        ),
        "falls_end_state": entry(
            spread,
            "L*",
            f"largest distance of the end states of {' and '.join(same)} from that of the first fall",
            "< 1e-3 L*",
            spread < 1e-3,
            source,
            2,
        ),
        "touch_convergence": entry(
            fine,
            "L*",
            f"change of the first touch's x when the elements are halved; the halving before: {coarse:.1e} L*",
            "less than from the coarser mesh, and < 5e-3 L*",
            fine < min(coarse, 5e-3),
            source,
            2,
        ),
        "handed_over": entry(
            float(data["handed_over"].max()),
            "L*",
            "largest distance between a state at rest and the equilibrium the static solver finds from it",
            "< 0.01 L*",
            float(data["handed_over"].max()) < 0.01,
            source,
            2,
        ),
    }


def _fall_benchmark(data: xr.Dataset, source: str) -> dict[str, Entry]:
    seconds, memory = float(data["wall"].median()), float(data["memory"])
    return {
        "time_fall": entry(
            seconds,
            "s",
            "median time of one `stripfold simulate`, statics, fall to rest and statics again, one core",
            "<= 20 s",
            seconds <= 20.0,
            source,
            3,
        ),
        "memory_fall": entry(memory, "MB", "peak memory of that process", "<= 500 MB", memory <= 500.0, source, 3),
    }
