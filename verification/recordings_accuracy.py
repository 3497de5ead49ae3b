"""The accuracy of measured values of lambda, from many small synthetic recordings, each with its truth.

The recordings are rendered, encoded and measured like any other.  The truth is from the kinetic energy of the motion
itself: the detector (:mod:`stripfold.film.snap`), with its window and its robust speed, has no part in it.
Where a strip moves by mechanics behind a slow gripper, eta_b by its motion is compared with the true one: with no
friction described, and with its friction, to an error as of a bending test, and an eta_b that is wrong.
Every fourth recording is of the second generator (:mod:`verification.films.second`), which brings its own truth.
"""

from __future__ import annotations

import json
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from scipy import stats

from stripfold.base.arrays import Array, Mask
from stripfold.base.material import GRAVITY, Material
from stripfold.draw.colours import BLACK, BLUE, GREY, SKY, VERMILLION
from stripfold.draw.style import MILLI, figure, styled
from stripfold.film import eta_motion, measure, recording
from stripfold.film.calibration import Calibration, calibrate_folder
from stripfold.film.camera_motion import MOVED_BY
from stripfold.film.eta_motion import MotionEtaB
from stripfold.film.measure import WARNING, RecordingMeasurement
from stripfold.film.recording import Entries, Recording, half_width
from stripfold.film.tracking import track
from verification.common import Progress, attempted, pooled, table
from verification.films import CHAIN, Film, film, truth_of
from verification.numbers import Facts, Number, covers, seed_of, share

UNITS = {"s": "clock_offset clock_sd clock_truth", "m": "event sd truth"}

MEASURED, BOUND, REFUSED, NOT_MADE = "measured", "bound", "refused", "not made"
"""Outcomes: a value; a bound, since no snap was seen; an error of the measurement; one of the motion or the film."""
ETA = "eta", "low", "high"
"""eta_b by the motion and the ends of its interval, over the true one; "fitted_" before: with no friction described."""
VALUES = (
    *("event", "truth", "sd", "clock_offset", "clock_truth", "clock_sd", "fitted_moment", *ETA),
    *map("fitted_{}".format, ETA),
)
WRONG = 0.7, 1.4
"""Described eta_b over the true one."""
FRICTION_SD = 0.1
"""Standard deviation of the described friction, as a share."""
RHO_A = 0.2
"""Described areal density, kg m^-2: friction over it matters."""
CHAIN_EVERY = 4
"""One film in so many is of the second generator."""
WRONG_RECORDING = 1.0
"""Error of lambda, outside the interval, from which a measured value is wrong, mm."""
LINEAR = 0.3
"""Errors below are drawn on a linear scale, larger ones on a logarithmic one, mm."""
_CALIBRATIONS: dict[Path, Calibration] = {}
"""Of each camera, by its folder: its films share one."""


def run(
    cases: int = 12, seed: int = 1, dynamics: float = 0.25, threads: int = 1, progress: Progress | None = None
) -> xr.Dataset:
    """Render and measure the first films of a design, see :func:`.films.film`; a dataset over ``case``."""
    films = [film(number, seed, dynamics, number % CHAIN_EVERY == 1) for number in range(cases)]
    with tempfile.TemporaryDirectory() as folder:
        # Before the processes start: two of them would render the same calibration.
        for asked in {asked.camera: asked for asked in films}.values():
            attempted(partial(asked.write_calibration, Path(folder)))
        rows = pooled(partial(measured, calibrations=Path(folder)), list(enumerate(films)), threads, progress)
    return table("case", rows, {"seed": seed, "dynamics": dynamics}, UNITS)


def measured(case: tuple[int, Film], calibrations: Path) -> dict[str, Any]:
    """A film, rendered and measured; ``calibrations`` is a folder that all share."""
    number, asked = case
    row = {"case": number, **dict.fromkeys(VALUES, np.nan), "message": "", "flags": ""}
    row |= {"generator": asked.generator, "sound": float(asked.sound), "moment": asked.moment}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "recording"
        _, message = attempted(lambda: asked.write(folder, calibrations))
        if message:
            return row | {"outcome": NOT_MADE, "message": message}
        told = recording.read(folder)
        found, message = attempted(lambda: _measured(told, calibrations / asked.camera))
        if found is None:
            return row | {"outcome": REFUSED, "message": message}
        if np.isfinite(asked.moment):
            row |= _ratios("fitted_", found, asked)
            again = _described(told, asked, np.random.default_rng([asked.seed, number, 4]))
            row |= _ratios("", attempted(partial(measure.evaluate, again, found.calibration, found.tracks))[0], asked)
        row["truth"] = truth_of(folder)[1]
        clock = json.loads((folder / "truth.json").read_text(encoding="utf-8"))["clock_offset"]
    # What moves without mechanics has no shape of a strip.
    expected = [eta_motion.doubted(found.eta_b)] if asked.generator == "shapes" else []
    if found.clock is not None:
        row |= {"clock_offset": found.clock.offset, "clock_truth": clock, "clock_sd": found.clock.sd}
    flags = "; ".join(str(flag) for flag in found.flags if flag.text not in expected)
    outcome = MEASURED if found.snapped else BOUND
    return row | {"outcome": outcome, "event": found.event, "sd": found.sd, "flags": flags}


def _measured(told: Recording, camera: Path) -> RecordingMeasurement:
    """As :func:`.measure.measure` does it, with the calibration of a camera evaluated once."""
    if camera not in _CALIBRATIONS:
        _CALIBRATIONS[camera] = calibrate_folder(told.folder, told.entries)
    return measure.evaluate(told, _CALIBRATIONS[camera], track(told, _CALIBRATIONS[camera]))


def _described(told: Recording, asked: Film, random: np.random.Generator) -> Recording:
    """The same recording with a wrong eta_b of the strip, and its friction as of a bending test."""
    true = asked.moment * RHO_A * GRAVITY * Material(asked.eta_b).gravity_length ** 2
    strip = {"eta_b": asked.eta_b * float(np.exp(random.uniform(*np.log(WRONG)))), "rho_a": RHO_A}
    strip["friction_moment"] = true * float(np.exp(random.normal(0.0, FRICTION_SD)))
    entries = told.entries.model_dump(mode="json", exclude_unset=True)
    return Recording(told.folder, Entries.of(entries | {"strip": entries["strip"] | strip}))


def _ratios(kind: str, found: RecordingMeasurement | None, asked: Film) -> dict[str, float]:
    """The numbers of :data:`ETA`, and M_0 where it is fitted; none where there is no eta_b."""
    if found is None or not isinstance(found.eta_b, MotionEtaB):
        return {}
    values = found.eta_b.eta_b, found.eta_b.low, found.eta_b.high
    ratios = {kind + name: value / asked.eta_b for name, value in zip(ETA, values, strict=True)}
    return ratios if found.eta_b.known else ratios | {"fitted_moment": found.eta_b.friction}


def error(data: xr.Dataset) -> Array:
    """Measured minus true lambda of the measured cases, m, shape (n,)."""
    chosen = data["outcome"].values == MEASURED
    return np.asarray((data["event"] - data["truth"]).values[chosen], dtype=np.float64)


def of_intervals(off: Array, half: Array) -> dict[str, Any]:
    """Number of errors, their median, largest and root mean square, and the share within ``half``; nan of none."""
    some = off if off.size else np.array([np.nan])
    return {
        "": off.size,
        "_median": np.median(np.abs(some)),
        "_worst": np.abs(some).max(),
        "_rms": np.sqrt(np.mean(some**2)),
        "_share": share(np.abs(off) <= half),
    }


def facts(d: xr.Dataset) -> Facts:
    """In mm and ms; nan where nothing was measured, so that no criterion holds."""
    outcome, off = d.outcome.values, 1e3 * error(d)
    flags, sd, sound, generator = (
        d[name].values[outcome == MEASURED] for name in ("flags", "sd", "sound", "generator")
    )
    refused, sound = ~np.isin(outcome, (MEASURED, BOUND)), sound == 1.0
    warned = np.array([WARNING in text for text in flags], dtype=bool)
    half, half_50 = (1e3 * half_width(level) * sd for level in (0.95, 0.5))
    wrong = (np.abs(off) > WRONG_RECORDING) & (np.abs(off) > half)
    each = {name: of_intervals(off[generator == name], half[generator == name]) for name in np.unique(generator)}
    told = (f"{name} {one['_share']:.3f} of {one['']}, {one['_rms']:.2f} mm" for name, one in each.items())
    some = off if off.size else np.array([np.nan])
    median = np.median(some)
    found: Facts = {
        "cases": d.sizes["case"],
        "seed": seed_of(d),
        "half": share(np.abs(off) <= half_50),
        "share_error": np.sqrt(0.95 * 0.05 / max(off.size, 1)),
        "half_error": np.sqrt(0.25 / max(off.size, 1)),
        "median": median,
        "mean": some.mean(),
        "sd": 1.4826 * np.median(np.abs(some - median)),
        "refused_share": share(refused),
        "refused": refused.sum(),
        "unseen": np.sum(outcome == BOUND),
        "wrong": np.sum(wrong & ~warned),
        "wrong_all": wrong.sum(),
        "warned": share(warned[sound]),
        "camera_moved": sum(MOVED_BY in text for text in (*d.flags.values, *d.message.values)),
        "generators": "; ".join(told),
    }
    clock, clock_sd = 1e3 * (d.clock_offset - d.clock_truth).values, 1e3 * d.clock_sd.values
    known = np.isfinite(clock_sd)
    clock, clock_sd = clock[known], clock_sd[known]
    kinds = {"measured": (off, half), "sound": (off[sound], half[sound])}
    kinds["clocks"] = clock, half_width(0.95) * clock_sd
    # eta_b by the motion, of films that begin as early as docs/measuring.md asks, and of the second generator's.
    chain = d.generator.values == CHAIN
    for which, mine in (("", ~chain), ("chain_", chain)):
        found[f"{which}eta_cases"] = np.sum(np.isfinite(d.moment.values) & mine)
        for kind in ("", "fitted_"):
            used = mine & np.isfinite(d[f"{kind}eta"].values)
            eta, low, high = (d[kind + name].values[used] - 1.0 for name in ETA)
            # The truth is within where the distance to the nearer end has the other sign.
            kinds[f"{which}{kind}eta"] = eta, np.where((low <= 0.0) & (high >= 0.0), np.inf, -1.0)
            found[f"{which}{kind}eta_half"] = np.median(high - low) / 2.0 if used.any() else np.nan
    excess = (d.fitted_moment - d.moment).values[~chain]
    found["excess"] = np.median(excess[np.isfinite(excess)]) if np.isfinite(excess).any() else np.nan
    found["clock_half"] = share(np.abs(clock) <= half_width(0.5) * clock_sd)
    for name, (of, within) in kinds.items():
        found |= {name + key: value for key, value in of_intervals(of, within).items()}
    return found


# fmt: off
NUMBERS = {
    facts: (
        Number("lambda_coverage", "measured_share", "1", "0.93 to 0.97",
            "share of the 95 % intervals of lambda that contain the truth, {measured} measured of {cases} synthetic "
            "recordings ({seed}); {refused} refused and {unseen} without a snap have no interval and do not count; by "
            "generator, with the root mean square error: {generators}; binomial standard deviation of such a share "
            "{share_error:.3f}",
            lambda f: covers(f.measured_share, f.measured, 0.93, 0.97)),
        Number("lambda_coverage_50", "half", "1", "0.48 to 0.52",
            "share of the 50 % intervals of lambda that contain the truth, {measured} measured ({seed}); binomial "
            "standard deviation of such a share {half_error:.3f}",
            lambda f: covers(f.half, f.measured, 0.48, 0.52)),
        Number("clock_coverage", "clocks_share", "1", "0.93 to 0.97",
            "share of the 95 % intervals of the offset between robot log and video that contain the truth, "
            "of {clocks} ({seed}); 50 % intervals {clock_half:.3f}; median error {clocks_median:.1f} ms, "
            "root mean square {clocks_rms:.1f} ms",
            lambda f: covers(f.clocks_share, f.clocks, 0.93, 0.97)),
        Number("lambda_rms_clean", "sound_rms", "mm", "< 0.15 mm",
            "root mean square error of lambda in the {sound} measured recordings that are filmed as docs/measuring.md "
            "asks for ({seed}); largest {sound_worst:.2f} mm"),
        Number("lambda_bias", "median", "mm", "absolute value < 0.1 mm",
            "median error of lambda at the onset in the {measured} measured recordings; mean {mean:.2f} mm",
            lambda f: abs(f.median) < 0.1),
        Number("lambda_sd", "sd", "mm", "no criterion",
            "standard deviation of that error, from its median absolute deviation; root mean square "
            "{measured_rms:.2f} mm"),
        Number("recordings_failed", "refused_share", "1", "<= 0.03",
            "share of the {cases} synthetic recordings that end in an error; in {unseen} more no snap is seen"),
        Number("recordings_flagged", "warned", "1", "<= 0.15",
            "share with a warning of the {sound} measured recordings that are filmed as docs/measuring.md asks for "
            "({seed})"),
        Number("recordings_wrong", "wrong", "count", "= 0",
            "measured lambda more than 1 mm off and outside its 95 % interval, without a warning, of {measured} "
            "({seed})"),
        Number("camera_false_alarms", "camera_moved", "count", "= 0",
            "recordings of the {cases}, none of whose cameras moves, that are said to be of one that does"),
        Number("eta_motion_error", "eta_median", "1", "<= 0.03",
            "median relative error of eta_b by the strip's motion before the snap, its friction described to 10 % and "
            "its eta_b wrongly, {eta} of {eta_cases} synthetic recordings with a slow gripper from 0.7 L* "
            "before the limit on ({seed}); largest {eta_worst:.2%}; of {chain_eta} of {chain_eta_cases} of "
            "the second generator, which begin nearer to it, {chain_eta_median:.2%} and {chain_eta_worst:.2%}"),
        Number("eta_motion_error_fitted", "fitted_eta_median", "1", "<= 0.03",
            "the same with no friction described, M_0 fitted beside eta_b, by the median {excess:.3f} rho_a g L*^2 too "
            "large; largest {fitted_eta_worst:.2%}; second generator {chain_fitted_eta_median:.2%} and "
            "{chain_fitted_eta_worst:.2%}"),
        Number("eta_motion_coverage", "eta_share", "1", ">= 0.9",
            "share of the 95 % intervals of that eta_b that contain the truth, median half width {eta_half:.2%}; with "
            "the friction fitted {fitted_eta_share:.2f} and {fitted_eta_half:.2%}; second generator "
            "{chain_eta_share:.2f} and {chain_fitted_eta_share:.2f}",
            lambda f: covers(min(f.eta_share, f.fitted_eta_share), f.eta, 0.9, 1.0)),
        Number("recordings_wrong_all", "wrong_all", "count", "no criterion",
            "measured lambda more than 1 mm off and outside its 95 % interval, with a warning or without, of "
            "{measured} ({seed})"),
    ),
}
# fmt: on


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the error of lambda in each synthetic recording with its interval, and the share that holds the truth.

    ``data`` is over ``case`` (:mod:`verification.recordings_accuracy`).
    """
    measured = data["outcome"].values == MEASURED
    order = np.argsort(data["sd"].values[measured])
    off, sd = (MILLI * values[order] for values in (error(data), data["sd"].values[measured]))
    warned = np.array([WARNING in text for text in data["flags"].values[measured][order]], dtype=bool)
    half, rank = half_width(0.95) * sd, np.arange(len(off))
    inside = np.abs(off) <= half
    colours = np.where(inside, GREY, VERMILLION)
    fig = figure(4.4)
    top, bottom = fig.subplots(2, 1, height_ratios=(1.5, 1.0))
    limit = 1.1 * float((np.abs(off) + half).max()) if len(off) else 1.0
    top.vlines(rank, off - half, off + half, colors=colours, lw=0.7)
    top.scatter(rank, off, s=3.0, c=np.where(inside, BLACK, VERMILLION), zorder=3)
    top.axhline(0.0, color=BLACK, lw=0.8)
    top.set_yscale("symlog", linthresh=LINEAR)
    top.set_yticks([sign * 10.0**power for power in range(-1, 4) for sign in (-1.0, 1.0)] + [0.0])
    top.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    top.set(ylim=(-limit, limit), ylabel=r"error of $\lambda$ [mm]", xlabel="recordings, ordered by standard deviation")
    generator = data["generator"].values[measured][order]
    shares = {name: _share(inside[generator == name]) for name in np.unique(generator)}
    apart = ", ".join(f"{name}: {share}" for name, share in shares.items())
    said = f"95 % intervals: {_share(inside)} hold the truth\n({apart})" if len(off) else "nothing was measured"
    top.set_title(said, loc="left", fontsize=7)
    z, bins = off / sd, np.linspace(-5.0, 5.0, 41)
    shown = np.clip(z, bins[0], bins[-1])  # beyond: in the outermost bin
    bottom.hist([shown[~warned], shown[warned]], bins, stacked=True, color=[BLUE, SKY], label=["no warning", "warning"])
    x = np.linspace(-5.0, 5.0, 201)
    area = len(z) * (bins[1] - bins[0])
    bottom.plot(x, area * stats.norm.pdf(x), color=BLACK, lw=1.0, label="normal, as stated")
    bottom.set(xlabel="error / standard deviation", ylabel="recordings", xlim=(-5.0, 5.0))
    bottom.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, fontsize=7)
    return fig


def _share(inside: Mask) -> str:
    return f"{100.0 * inside.mean():.1f} % of {len(inside)}"
