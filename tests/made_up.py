"""Small made-up datasets for figures and films: motions along x, folding paths and friction on them, recordings."""

from __future__ import annotations

import numpy as np
import xarray as xr

from tasks import assess_data, friction

LENGTH, HEIGHT = 0.6, 0.15
LAMBDA_0, LAMBDA_C, LAMBDA_END = 0.12, 0.36, 0.6
TOUCH, SETTLE = 0.5, 2.0
COUNTS = {"before": 31, "fall": 41, "after": 21}
NODES = 61


def collapse(after: bool = True) -> xr.Dataset:
    """A straight leg down to a sag that goes down to the floor in the fall; times in it are not evenly spaced."""
    way = {phase: np.linspace(0.0, 1.0, count) for phase, count in COUNTS.items()}
    time = SETTLE * way["fall"] ** 2
    advance = np.concatenate(
        [
            LAMBDA_0 + (LAMBDA_C - LAMBDA_0) * way["before"],
            np.full(COUNTS["fall"], LAMBDA_C),
            LAMBDA_C + (LAMBDA_END - LAMBDA_C) * way["after"],
        ]
    )
    down = np.concatenate([np.zeros(COUNTS["before"]), np.minimum(time / TOUCH, 1.0), np.ones(COUNTS["after"])])
    s = np.linspace(0.0, LENGTH, NODES)
    # From the gripper down to the floor within 0.2 m, and lying from there on; the sag is a cosine.
    hanging = s < 0.2
    x = np.where(hanging, advance[:, None] - LENGTH / 2.0, s - LENGTH / 2.0)
    sag = 0.02 * np.exp(-(((s - 0.25) / 0.05) ** 2))
    z = np.where(hanging, HEIGHT * (1.0 - s / 0.2), 0.0) + (1.0 - down[:, None]) * np.where(hanging, 0.0, sag)
    phase = np.repeat(list(COUNTS), list(COUNTS.values()))
    falling = phase == "fall"

    def in_fall(values: np.ndarray) -> np.ndarray:
        out = np.full(len(phase), np.nan)
        out[falling] = values
        return out

    share = np.minimum(time / SETTLE, 1.0)
    deflection = np.sqrt(np.mean((x - x[0]) ** 2 + (z - z[0]) ** 2, axis=1))
    at = ("state",)
    columns = {
        "time": (at, in_fall(time), "s"),
        "advance": (at, advance, "m"),
        "deflection": (at, deflection, "m"),
        "kinetic": (at, in_fall(2e-4 * share * (1.0 - share)), "J m-1"),
        "elastic": (at, 0.03 + in_fall(2e-3 * share), "J m-1"),
        "gravity": (at, 0.12 - in_fall(3e-3 * share), "J m-1"),
        "work": (at, in_fall(0.0 * share), "J m-1"),
        "air": (at, in_fall(5e-4 * share), "J m-1"),
        "viscous": (at, in_fall(3e-4 * share - 2e-4 * share * (1.0 - share)), "J m-1"),
        "contact": (at, in_fall(1e-4 * share), "J m-1"),
        "numerical": (at, in_fall(1e-4 * share), "J m-1"),
        "closing": (at, in_fall(-3e-15 * np.sign(share)), "J m-1"),
        "contacts": (at, np.full(len(phase), 40.0), "1"),
        "minimal_gap": (at, np.zeros(len(phase)), "m"),
        "x": ((*at, "node"), x, "m"),
        "z": ((*at, "node"), z, "m"),
        "arc": (("node",), s, "m"),
    }
    data = xr.Dataset({name: (dims, v, {"units": u, "long_name": name}) for name, (dims, v, u) in columns.items()})
    data = data.assign_coords(phase=("state", phase.astype(object), {"units": "1", "long_name": "part of the motion"}))
    data = data.assign(gripper_height=HEIGHT, lambda_0=LAMBDA_0, lambda_c=LAMBDA_C)
    data = data.assign(touch_time=TOUCH, touch_x=-0.05, settle_time=SETTLE)
    data.attrs = {"length": LENGTH, "gravity_length": 0.03, "eta_b": 3780.0}
    return data if after else until_touch(data)


def until_touch(data: xr.Dataset) -> xr.Dataset:
    """The same, as it is when only the way to the first touch was asked for."""
    keep = (data["phase"].values == "before") | (data["time"].values <= TOUCH)
    return data.isel(state=np.flatnonzero(keep)).assign(settle_time=np.nan)


UNIT = 0.03
"""L* of the strip on folding paths, m."""
RADIUS = 0.2
LABELS = {"soft": "η_b = 3780 m⁻⁴ s²", "stiff": "η_b = 820 m⁻⁴ s²", "cloth": "some cloth"}
ETAS, UNITS, LENGTHS = np.array([3780.0, 820.0, 95.0]), np.array([0.03, 0.05, 0.1]), np.array([0.6, 0.6, 2.0])
TOUCH_ERRORS = {"r-path": (-0.3, -0.2, -0.5), "triangular": (-1.2, -0.9, -1.1), "circular": (0.7, np.nan, 0.6)}
"""L*, for each material."""


def _leg(time: np.ndarray, dip: np.ndarray | float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arc length and places x and z of a straight leg that turns over, ``dip`` lower at its middle."""
    s = np.linspace(0.0, LENGTH, NODES)
    leg = np.maximum(RADIUS - s, 0.0) * np.ones((len(time), 1))
    angle = np.pi * time[:, None]
    bump = np.where(leg > 0.0, leg * (RADIUS - leg) / RADIUS**2, 0.0)
    lower = np.reshape(np.asarray(dip) * np.ones(len(time)), (-1, 1)) * bump
    x = np.where(leg > 0.0, RADIUS - LENGTH / 2.0 - leg * np.cos(angle), s - LENGTH / 2.0)
    return s, x, leg * np.sin(angle) - lower


def _rows(pieces: list[tuple[str, int, np.ndarray, np.ndarray | float]]) -> xr.Dataset:
    """States of phase, part, pseudo time and dip, with the layout of ``tasks.states``."""
    time = np.concatenate([times for _, _, times, _ in pieces])
    dip = np.concatenate([np.ones(len(times)) * d for _, _, times, d in pieces])
    s, x, z = _leg(time, dip)
    columns = {
        "pseudo_time": (("state",), time, "1"),
        "part": (("state",), np.repeat([p for _, p, _, _ in pieces], [len(t) for _, _, t, _ in pieces]), "1"),
        "x": (("state", "node"), x, "m"),
        "z": (("state", "node"), z, "m"),
        "arc": (("node",), s, "m"),
    }
    data = xr.Dataset({name: (dims, v, {"units": u, "long_name": name}) for name, (dims, v, u) in columns.items()})
    phase = np.repeat([p for p, _, _, _ in pieces], [len(t) for _, _, t, _ in pieces]).astype(object)
    data = data.assign_coords(phase=("state", phase, {"units": "1", "long_name": "phase"}))
    return data.assign_attrs(length=LENGTH, gravity_length=UNIT)


def assessment(critical: bool = True) -> xr.Dataset:
    """A path on which a strip falls at the pseudo time 0.5, or on which it does not."""
    before = ("static", 0, np.linspace(0.0, 0.5 if critical else 1.0, 21), 0.0)
    fall = ("fall", 1, np.full(11, 0.5), np.linspace(0.0, 0.1, 11))
    after = ("static", 2, np.linspace(0.5, 1.0, 13), 0.1)
    return _rows([before, fall, after] if critical else [before]).assign_attrs(
        critical_points=float(critical), touch_x=-0.05 if critical else np.nan
    )


def two_ways() -> xr.Dataset:
    """Two ways out at the pseudo time 0.6: first one that rises, then one that touches at x = -0.04 m."""
    pieces = []
    for way, dip in enumerate((-0.2, 0.1)):
        pieces.append(("fall", 2 * way, np.full(9, 0.6), np.linspace(0.0, dip, 9)))
        pieces.append(("static", 2 * way + 1, np.linspace(0.6, 0.7 if way == 0 else 1.0, 7), dip))
    data = _rows(pieces)
    data["way"] = (("state",), np.repeat([0.0, 1.0], 16), {"units": "1", "long_name": "way"})
    return data.assign_attrs(reason="", touch_x=[np.nan, -0.04])


def without_ways() -> xr.Dataset:
    """What is stored where there is no unstable planned state."""
    return xr.Dataset(attrs={"length": LENGTH, "reason": "there is no unstable planned state"})


def with_friction(suffices: tuple[float, float] = (0.08, 0.009), attrs: dict[str, float] | None = None) -> xr.Dataset:
    """A path followed with both laws; from 0.5 to 0.6 friction alone holds the strip; the first touch is at 0.6."""
    laws = friction.LAWS
    time = np.linspace(0.0, 1.0, 41)
    alone = (time > 0.499) & (time < 0.601)
    s, x, z = _leg(time, 0.02)
    _, _, other = _leg(time, 0.04)
    ratio = np.where(time < 0.61, 0.001 + 0.1 * time**2, 5.0)
    on = ("law", "state")
    columns = {
        "fails": (("law",), np.array(suffices) / 1.1, "1"),
        "suffices": (("law",), np.array(suffices), "1"),
        "touch_x": (("law",), np.full(2, -0.03), "m"),
        "touch_step": (("law",), np.full(2, 24.0), "1"),
        "pseudo_time": (on, np.array([time, time]), "1"),
        "ratio": (on, np.array([ratio, 0.0 * ratio]), "1"),
        "eigenvalue": (on, np.array([np.where(alone, -3.0, 4.0)] * 2), "s-2"),
        "deviation": (on, np.array([0.01 * time] * 2), "m"),
        "x": ((*on, "node"), np.array([x, x]), "m"),
        "z": ((*on, "node"), np.array([z, other]), "m"),
        "arc": (("node",), s, "m"),
    }
    data = xr.Dataset({name: (dims, v, {"units": u, "long_name": name}) for name, (dims, v, u) in columns.items()})
    data = data.assign_coords(law=("law", np.array(laws, dtype=object), {"units": "1", "long_name": "law"}))
    return data.assign_attrs(attrs or {"step": 0.1 * UNIT, "gravity_length": UNIT})


def plans() -> xr.Dataset:
    """The same path for all three, with its states."""
    time = np.linspace(0.0, 1.0, 51)
    s, x, z = _leg(time)
    on = ("path", "place")
    columns = {
        "pseudo_time": (on, np.array([time] * 3)),
        "x": ((*on, "node"), np.array([x] * 3)),
        "z": ((*on, "node"), np.array([z] * 3)),
        "arc": (("node",), s),
    }
    data = xr.Dataset({name: (dims, v, {"units": "m", "long_name": name}) for name, (dims, v) in columns.items()})
    data = data.assign_coords(path=("path", np.array(assess_data.PATHS, dtype=object)))
    return data.assign_attrs(length=LENGTH, lying_length=0.26, planned_touch_x=0.05)


def assessments() -> xr.Dataset:
    """The table of three materials; the second strip does not touch on the circular path, the third does not fall."""
    files = {}
    for i, material in enumerate(LABELS):
        for path in assess_data.PATHS:
            numbers = dict.fromkeys(assess_data.NUMBERS, 0.0)
            error = TOUCH_ERRORS[path][i] * UNITS[i]
            numbers |= {"planned_touch_x": 2.6 * UNITS[i], "touch_error": error, "fell": float(i < 2)}
            numbers |= {"landing_x": 3.6 * UNITS[i], "relative_length": LENGTHS[i] / UNITS[i]}
            numbers |= {"touch_uncertainty": 0.05 * UNITS[i]}
            files[material, path] = xr.Dataset(
                attrs={**numbers, "eta_b": ETAS[i], "gravity_length": UNITS[i], "rho_a": 1.0}
            )
    return assess_data.table(files, LABELS)


def frictions() -> xr.Dataset:
    """The friction that the three materials need, with steps of 0.1 L*."""
    files = {}
    for i, material in enumerate(LABELS):
        names = ("eta_b", "gravity_length", "relative_length", "step", "k_f", "M_0", "planned_touch_x")
        values = (ETAS[i], UNITS[i], LENGTHS[i] / UNITS[i], 0.1 * UNITS[i], 25.0, 7e-5, 0.08)
        attrs = {name: float(value) for name, value in zip(names, values, strict=True)}
        files[material] = with_friction((0.08 + 0.02 * i, 0.009 - 0.002 * i), attrs)
    return friction.table(files, dict.fromkeys(LABELS, xr.Dataset()), LABELS)


TOUCH_LIMIT = 1.6
"""Height under which the sag of the made-up elastica touches first, L*."""


def x_axis() -> xr.Dataset:
    """Two heights, 8 and 6 steps padded to 9, 40 nodes padded to 44; the lower height has no snap."""
    steps, nodes = (6, 8), 40
    shape = (2, 9)
    lam, deflections, negatives = (np.full(shape, np.nan) for _ in range(3))
    x, z = np.full((*shape, 44), np.nan), np.full((*shape, 44), np.nan)
    heights = np.array([1.2, 3.0]) * UNIT
    s = np.linspace(0.0, LENGTH, nodes)
    for i, count in enumerate(steps):
        way = np.arange(count) / 5.0
        # On the second height lambda rises to step 5 and falls after it.
        lam[i, :count] = 0.06 + 0.2 * np.where(way <= 1.0, way, 2.0 - way)
        deflections[i, :count] = 0.1 * way
        negatives[i, :count] = way > 1.0
        for j in range(count):
            x[i, j, :nodes] = np.maximum(s - LENGTH / 2.0, lam[i, j] - LENGTH / 2.0 + 0.2 * s)
            z[i, j, :nodes] = heights[i] * np.maximum(1.0 - s / (0.15 + 0.1 * way[j]), 0.0) ** 2
    at = ("gripper_height", "step")
    columns = {"advance": lam, "deflection": deflections, "negatives": negatives}
    data = xr.Dataset({name: (at, values) for name, values in columns.items()}, coords={"gripper_height": heights})
    data = data.assign(x=((*at, "node"), x), z=((*at, "node"), z), snap=("gripper_height", [0, 1]))
    data = data.assign(lambda_0=("gripper_height", [0.06, 0.06]), lambda_c=("gripper_height", [np.nan, 0.26]))
    return data.assign_attrs(length=LENGTH, gravity_length=UNIT, thickness=0.0018)


def elastica_curve() -> xr.Dataset:
    """A made-up elastica: lambda_c = 7 + z from the touch limit on."""
    z = np.linspace(1.0, 9.0, 41)
    lam = np.where(z >= TOUCH_LIMIT, 7.0 + z, np.nan)
    return xr.Dataset({"lambda_c": ("z", lam)}, coords={"z": z}, attrs={"touch_limit": TOUCH_LIMIT})


def materials() -> xr.Dataset:
    """Three materials, 0.01 L*, 0.02 L*, 0.03 L* below the made-up elastica; heights in no order, padded."""
    units = np.array([0.05, 0.03, 0.1])
    z = np.array([3.0, 1.2, 2.0, 5.0, np.nan])
    snap = np.where(np.isnan(z), np.nan, z > TOUCH_LIMIT) * np.ones((3, 1))
    end = np.where(snap == 1.0, 7.0 + z, 8.4) - 0.01 * np.arange(1, 4)[:, None]
    rows = {"gripper_height": z, "lambda_end": end, "lambda_c": np.where(snap == 1.0, end, np.nan), "lambda_0": z - 0.5}
    rows = {name: units[:, None] * np.where(np.isnan(snap), np.nan, row) for name, row in rows.items()}
    rows |= {"snap": snap, "lambda_error": 0.002 * units[:, None] * np.ones(5)}
    data = xr.Dataset({name: (("material", "height_index"), row) for name, row in rows.items()})
    labels = ["η_b = 820 m⁻⁴ s²", "η_b = 12700 m⁻⁴ s²", "textile, secant η_b"]
    columns = {"eta_b": [820.0, 12700.0, 94.93], "gravity_length": units, "length": 20.0 * units, "label": labels}
    data = data.assign({name: ("material", values) for name, values in columns.items()})
    return data.assign_coords(material=["soft", "softer", "textile"])


def recordings() -> xr.Dataset:
    """Two materials, two heights, two speeds; one without a snap."""
    eta, z, v = (a.ravel() for a in np.meshgrid([820.0, 3780.0], [0.1, 0.2], [0.001, 0.002], indexing="ij"))
    event = 3.0 * z + 5.0 * v
    fields = {"eta_b": eta, "gripper_height": z, "speed": v, "lambda_model": 3.0 * z, "lambda_event": event}
    fields |= {"lambda_low": event - 1e-3, "lambda_high": event + 1e-3, "synthetic": np.ones(8)}
    fields["snapped"] = np.array([1.0] * 7 + [0.0])
    data = xr.Dataset({name: ("recording", values) for name, values in fields.items()})
    track = np.stack([event[:, None] + np.linspace(-0.01, 0.0, 5), np.repeat(z[:, None], 5, 1)], axis=2)
    return data.assign(track=(("recording", "sample", "axis"), track))
