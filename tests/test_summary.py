"""The numbers that are quoted, and the README that quotes them."""

from __future__ import annotations

import doctest
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from scipy import stats

import stripfold.base.material
from plots import gallery_markdown
from stripfold.cli import COMMANDS
from stripfold.files import store
from studies import physics_tables
from studies.accuracy import presets
from studies.schemes import CONSERVING, DEFAULT
from studies.summary.run import evaluate, fill_table, markdown, markers, quoted, summarise
from studies.summary.table import SOURCES
from tasks import numbers

ROOT = Path(__file__).parents[1]


def texts(*values: str) -> np.ndarray:
    return np.array(values, dtype=object)


Z = np.linspace(2.0, 12.0, 41)
BOTH = ("material", "height_index")
LENGTHS = ("length", "thickness")
LAW = ("material", "law")
RUN = ("material", "path")
PROJECT = xr.Dataset(
    attrs={
        "stale": "",
        "studies": 28,
        "package_lines": 15123,
        "docs_examples": 12,
        "ci_seconds": 470.0,
        "studies_seconds": 880.0,
        "untimed": 0,
    }
)
PRESET = ("asked", "accuracy", "gripper_height")
SCENE = ("scene", "effect")
MODEL = ("model", "gripper_height", "thickness")
ENERGIES = ("barrier", "work")
FUZZED = {"answered": 1000, "followed": 2000, "refused": 7000, "failed": 0}
LOW_PATH = {"height": 0.6, "length": 14.0, "thickness": 0.05, "hold": 7.5, "slide": 6.0, "error": 0.01}
LOW_CURVE = {"height": [0.3, 1.0, 1.58], "compliance": [0.01, 0.4, 0.0], "push": [30.0, 2.8, 1.2]}
LOW_TIME = {"kinetic": 0.02, "error": 0.01, "grip": 12.0}
NEEDED = np.array([[0.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
OUTCOME = texts(*["stable"] * 117, *["critical"] * 83, *["refused"] * 15, *["undecided"] * 2)
FOUND = np.where(OUTCOME == "critical", 10.0, np.nan)
QUANTILES = stats.norm.ppf((np.arange(201) + 0.5) / 201)
"""Errors in standard deviations that are distributed as stated."""


def datasets() -> dict[str, xr.Dataset]:
    """Small datasets in which every criterion holds: variables, coordinates, attributes."""
    lag: dict = {"lambda_c": ((), 11.7821)}
    for suffix, theory in (("", 0.8), ("_damped", 2.0 / 3.0)):
        dim = f"speed{suffix}"
        lag |= {dim: (dim, [1e-3, 1e-2]), f"lag{suffix}": (dim, [0.01, 0.06]), f"expected{suffix}": (dim, [0.01, 0.06])}
        lag |= {f"exponent{suffix}": theory - 0.01, f"exponent_half_width{suffix}": 0.005, f"theory{suffix}": theory}
        lag[f"limit{suffix}"] = 11.7824
    # fmt: off
    made = {
        "points": ({
            "gripper_height": (BOTH, 0.03 * Z[None]), "lambda_error": (BOTH, np.full((1, 41), 1e-5)),
            **{name: (BOTH, 0.03 * (Z[None] + 7.0)) for name in ("lambda_c", "lambda_c_lower", "lambda_c_upper")},
            "lambda_c_eigenvalue": (BOTH, 0.03 * (Z[None] + 7.0001)), "detectors_agree": (BOTH, np.ones((1, 41))),
            "thickness": ("material", [1.8e-3]),
            "snap": (BOTH, np.where(Z[None] > 2.0, 1.0, 0.0)), "gravity_length": ("material", [0.03])},
            {"material": ["cloth"]}),
        "master": ({"lambda_c": ("z", Z + 7.0)}, {"z": Z}, {"touch_limit": 1.58617085}),
        "limit": ({
            "difference": ("eta_m", [2e-4, 2e-5]), "mesh_error": ("eta_m", [1e-6, 1e-6]),
            "order": ("eta_m", [np.nan, 1.0]), "lambda_c_elastica": 9.856908},
            {"eta_m": [1e-3, 1e-4]}, {"height_star": 3.0}),
        "order": ({
            "order": ("model", [4.0, 3.2]), "cost_order": ("model", [0.9, 1.0]),
            "elements": (("model", "parts"), [[33.0, 10032.0]] * 2)}, {"model": ["rod", "solid"]}),
        "solver_constants": ({"constant": ("constant", texts("A", "B"))}, None, {"before": 3, "later": 0}),
        "low_paths": ({
            **{name: ("case", texts(*["stable"] * 200)) for name in ("solid", "finer", "rod")},
            **{name: ("case", np.full(200, value)) for name, value in LOW_PATH.items()},
            **{f"curve_{name}": ("curve", values) for name, values in LOW_CURVE.items()},
            **{f"time_{name}": (("mu", "time_height"), [[0.01], [value]]) for name, value in LOW_TIME.items()},
            "slow_kinetic": 0.0025, "snap_energy": 0.5}, {"mu": [0.0, 0.6]},
            {"speed": 0.05, "moment": 0.02, "length_star": 14.0}),
        "barrier": ({
            **{name: (("gripper_height", "distance"), 1.08 * np.array([[1e-6, 3.2e-5], [1e-6, np.nan]]))
               for name in ENERGIES},
            "model_coefficient": (("model", "gripper_height"), np.full((2, 2), 1.076)),
            **{name: ("gripper_height", [1.08, 1.08]) for name in ("coefficient", "width", "largest", "speed")}},
            {"gripper_height": [3.0, 2.0], "distance": [1e-4, 1.00794e-3], "model": ["rod", "solid"]}),
        "second_gripper": ({
            "gain": (("gripper_height", "place"), np.tile([0.1, 10.0], (2, 10))),
            "s": (("gripper_height", "place"), np.tile([1.0, 5.0], (2, 10))),
            "early_gain": (("gripper_height", "distance"), np.full((2, 1), 10.0)),
            **{name: ("gripper_height", [10.0, 10.0]) for name in ("possible", "chosen_gain")},
            **{name: ("gripper_height", [5.0, 5.0]) for name in ("chosen_s", "chosen_up")}},
            {"gripper_height": [3.0, 5.0], "distance": [0.5]}),
        "stability_map": ({
            "error": (("length", "case"), np.full((2, 50), 1e-7)), "wall": ("repeat", [3.0, 2.0, 9.0]),
            "elastica": ("rod_height", [9.0, 12.0]),
            "rod": (("thickness", "rod_height"), np.array([[0.998], [0.9995]]) * [9.0, 12.0])},
            {"thickness": [0.06, 0.03], "length": [12.0, 20.0]}),
        "knocks": ({
            "held": ("distance", [0.99, np.nan]), "fell": ("distance", [1.03, np.nan]),
            "away": ("distance", [1.0, 1e-5]), "touched": ("distance", [1.0, 1.0])},
            {"distance": [0.02, 0.1]}, {"height": 5.0, "width": 0.07}),
        "explorer": ({
            "error": ("place", np.full(20, 1e-4)), "warns": 1, "keyboard": 0.2, "narrow": -15.0, "bytes": 2_000_000},
            None, {"falls": "triangular circular r-path"}),
        "variants": ({
            "base": ("variant", texts("", *["rod"] * 11)), "snap": ("variant", np.ones(12)),
            "lambda_end_shift": ("variant", np.array([0.0, 1e-3, 2e-3, -0.06, -0.2, -0.5, 0.4, -0.01] + [0.0] * 4))},
            {"variant": texts("rod", "Poisson's ratio 0.3", "Poisson's ratio 0.45", "eta_m times 4",
                "narrow strip, Poisson's ratio 0.3", "gripper clamps at 0", "gripper clamps at -120", "pin gives",
                "others 1", "others 2", "others 3", "others 4")}, {"height": 3.0}),
        "eigenvalues": ({
            "distance": (("motion", "step"), np.tile([1e-3, 1e-4, 1e-5, 1e-12], (4, 1))),
            "eigenvalue_1": (("motion", "step"), np.tile([1e-2, 1e-2 * 0.1**0.5, 1e-3, 1e-7], (4, 1))),
            "eigenvalue_2": (("motion", "step"), np.ones((4, 4)))},
            {"motion": ["x", "r-path", "triangular", "circular"]}),
        "layer_friction": ({
            "error": (("path", "mu"), [[0.01] * 5, [0.01] * 5, [0.01, 0.01, 2.6, 2.1, 2.0]] ),
            "finer_error": ("path", [0.01, 0.01, 2.11]), "edge": (("path", "mu"), np.full((3, 5), 2.1)),
            "created": (("path", "mu"), np.full((3, 5), 1e-9)), "dissipated": (("path", "mu"), np.ones((3, 5))),
            "long_error": ("path", [0.01, 0.01, 3.8]), "long_error_without": 0.37,
            "speed_error": (("path", "gripper_speed"), np.full((3, 1), 2.0)),
            "fabric_error": ("path", [0.05, 0.1, 1.3]), },
            {"path": ["r-path", "triangular", "circular"], "mu": [0.0, 0.1, 0.2, 0.4, 0.6], "gripper_speed": [0.05]},
            {"shown": 0.4, "band": [0.2, 0.6], "length_star": 14.0, "long": 24.0, "fabric_moment": 0.3,
             "moment": 0.02}),
        "branches": ({
            "verdict": ("case", np.zeros(2000, int)),
            "spurious_limit_points": ("case", np.where(np.arange(2000) < 500, 0.0, np.nan))},),
        "benchmark": ({"seconds": ("repeat", [1.0]), "relative_error": ("repeat", [1e-3]), "memory": 200.0},),
        "schemes": ({
            "oscillator_order": ("scheme", [1.99, 2.0]), "swing_order": ("scheme", [1.98, 2.0]),
            "drift": ("scheme", [1e-9, 1e-9]), "numerical_share": ("scheme", [0.01, 0.0]),
            "contact_share": ("scheme", [0.02, 0.02])},
            {"scheme": [DEFAULT, CONSERVING], "swing_step": [0.4, 0.2]}),
        "modes": ({
            "motion_error": (("gravity", "mode", "steps"), np.full((2, 3, 1), 7e-4)),
            "solid_error": (("gravity", "mode"), np.full((2, 3), 4e-4))},
            {"steps": [100]}, {"length_star": 3.0, "elements": 24}),
        "lag": (lag, None, {"air": 1.0}),
        "falls": ({
            "touch_x": ("case", [0.77, 0.77, 0.77, 0.775, 0.7705, 0.78]), "minimal_gap": ("case", np.zeros(6)),
            "closing": ("case", np.full(6, 1e-12)), "distance": ("case", np.full(6, 1e-5)),
            "handed_over": ("case", [1e-4] * 5 + [np.nan])},
            {"case": ["base", "half the step", "other sign", "coarse mesh", "fine mesh", "no damping"]}),
        "commands": ({"files": ("command", [1.0] * (len(COMMANDS) + 1))}
            | {"differs": ("command", texts(*[""] * (len(COMMANDS) + 1)))},
            {"command": texts(*(f"{name} x" for name in COMMANDS), "critical y")}, {"repeats": 2}),
        "kills": ({"went_on": ("kill", np.ones(50)), "left": ("kill", [1.0] + [0.0] * 49),
            "differs": ("kill", texts(*[""] * 50)), "running": ("kill", texts(*["no job"] * 9, *["x_axis"] * 41)),
            "signal": ("kill", texts(*["SIGKILL"] * 20, *["SIGTERM"] * 30))}, {},
            {"seed": 3, "files": 181, "wall": 90.0}),
        "slurm_run": ({"same": ("file", np.ones(22))}, {"file": texts(*(f"{k}.nc" for k in range(22)))},
            {"jobs": 20, "wall_here": 60.0, "wall_there": 300.0}),
        "fuzz": ({name: ("kind", [count, 0]) for name, count in FUZZED.items()}, {"kind": texts("yaml", "data")},
            {"seed": 3, "failures": ""}),
        "wheels": ({
            "failed": (("environment", "command"), texts(*[""] * 6).reshape(2, 3)),
            "versions": ("environment", texts("numpy 2.0.0, scipy 1.14", "numpy 2.3.0, scipy 1.16"))},
            {"environment": texts("3.11 lowest", "3.11 newest"), "command": texts("critical", "film x", "eta")},
            {"absent": "3.14"}),
        "sweeps": ({
            "scenes": ("model", [100000, 1024]), "results": ("model", [100000, 1024]), "snaps": ("model", [9e4, 1e3]),
            "wall": ("model", [5.0, 12.0]), "cost": ("model", [1e-4, 0.02]), "memory": ("model", [140.0, 90.0]),
            "apart": ("model", [1e-12, 0.0])}, {"model": ["elastica", "rod"]},
            {"cores": 2, "checked": 40, "dry_run": 5.0}),
        "folding_plans": ({
            "path": ("case", texts(*["low"] * 200, *["triangular"] * 40, *["r-path"] * 10, *["none"] * 50)),
            "safe": ("case", [1.0] * 250 + [np.nan] * 50), "confirmed": ("case", [np.nan] * 250 + [1.0] * 50),
            "seconds": ("case", np.full(300, 1.1)),
            **{name: ("case", np.where(np.arange(300) < 60, 0.9, np.nan))
               for name in ("still_seconds", "speed_seconds", "r_path_refused")}}, {"case": np.arange(300)}),
        "fall_benchmark": ({"wall": ("repeat", [1.9]), "memory": 150.0},),
        "rod": ({
            "model_error": (MODEL[1:], [[5e-3, 4e-5]]), "mesh_error": (MODEL, np.full((2, 1, 2), 1e-4)),
            "lambda_c": (MODEL, np.full((2, 1, 2), 9.8)), "lambda_c_elastica": ("gripper_height", [9.86]),
            "derived": (("section", "gripper_height"), [[-5.77], [-5.84], [-6.22]])},
            {"thickness": [0.2, 0.0594], "model": ["rod", "solid"], "section": ["rod", "solid", "exact"]}),
        "rod_benchmark": ({
            "seconds": ("repeat", [0.019]), "estimated_error": 8e-4, "seconds_assess": ("repeat", [0.7]),
            "seconds_static": ("repeat", [0.1]),
            "apart": 1e-3},),
        "cli_benchmark": ({"wall": ("repeat", [0.8]), "solving": 0.1, "error": 1e-4},),
        "cold_run": ({"seconds": ("rule", [300.0, 200.0, 60.0, 1.0]), "jobs": ("rule", [40.0, 40.0, 5.0, 1.0])},
            {"rule": texts("record", "measure", "assess", "plans")}, {"wall": 290.0, "cores": 2}),
        "accuracy": ({
            "preset_seconds": (PRESET, np.full((2, 2, 2), 0.19)), "preset_estimate": (PRESET, np.full((2, 2, 2), 5e-4)),
            "preset_error": (PRESET, np.full((2, 2, 2), -2e-4)), "snaps": ("gripper_height", [1, 1]),
            "preset_model": (PRESET, [[["elastica"] * 2, ["rod"] * 2], [["solid"] * 2] * 2]),
            "elastica_seconds": ("gripper_height", [0.004, 0.005]),
            "elastica_error": ("gripper_height", [1e-12, -1e-12])},
            {"asked": ["auto", "solid"], "accuracy": [1e-2, 1e-3], "gripper_height": [3.0, 9.0]},
            {"thickness_star": 0.0594}),
        "estimates": ({
            "asked": ("case", texts(*["auto", "solid", "rod"] * 100)), "estimate": ("case", np.full(300, 1e-3)),
            "thickness": ("case", np.full(300, 0.05)), "nu": ("case", np.zeros(300)),
            "accuracy": ("case", np.full(300, 1e-3)), "outcome": ("case", texts(*["number"] * 300)),
            "error": ("case", np.full(300, 5e-4))},),
        # Two scenes: the first needs inertia only, the second self-contact as well.
        "effects": ({
            **{name: (SCENE, NEEDED.copy()) for name in ("needed", "reported", "matters")},
            "cost": (SCENE, [[0.07, 0.4, -0.01], [0.3, 0.5, 0.01]]),
            "clocked": (SCENE, [[0.02, np.nan, np.nan], [0.2, np.nan, np.nan]])},
            {"scene": ["calm", "wild"], "effect": ["self_contact", "inertia", "layers"]}),
        "hard_cases": ({
            "name": ("case", texts(*(f"case {i}" for i in range(40)))), "failed": ("case", np.zeros(40)),
            "outcome": ("case", texts(*["value"] * 30, *["NewtonError"] * 10))},),
        "tangency": ({
            "boundary_error": (LENGTHS, np.full((5, 2), -1e-4)), "angle": (LENGTHS, np.tile([8.0, 2.0], (5, 1))),
            "plan_error": ("length", np.full(5, 1e-12)), "elastica_error": ("length", np.full(5, -1e-13))},
            {"length": np.linspace(13.0, 30.0, 5), "thickness": [0.06, 0.015]}),
        # One point of the strip moves 0.9 L* in the fall.
        "collapse": ({
            "phase": ("state", texts("before", "fall", "fall", "after", "after")),
            "advance": ("state", 0.03 * np.array([11.0, 11.7, 11.71, 11.71, 20.0])),
            "x": (("state", "node"), np.zeros((5, 3))), "negatives": ("state", [0.0, np.nan, np.nan, 0.0, 0.0]),
            "z": (("state", "node"), 0.03 * np.array([[0.0, 1.0, 3.0]] * 2 + [[0.0, 0.1, 3.0]] * 3))},
            None, {"gravity_length": 0.03, "end": "above the held end"}),
        # Flat, half way up, and from there on with two nodes, 1 L*, on the floor.
        "plans": ({
            "arc": ("node", 0.03 * np.arange(5.0)),
            "z": (("path", "place", "node"),
                0.03 * np.array([[[0, 0, 0, 0, 0], [1, 1, 0, 0, 0], *[[3, 3, 2, 0, 0]] * 120, [0, 2, 2, 0, 0]]]))},
            {"path": ["r-path"]}, {"gravity_length": 0.03, "lying_length": 0.03}),
        "printed_law": ({
            "stiffness_printed": ("angle", [1.0, 0.0]), "stiffness_svk": ("angle", [1.0, 1.0])},
            {"angle": [0.0, 90.0]}),
        "assessment": ({
            "critical_points": (RUN, np.ones((2, 3))), "critical_angle": (RUN, [[8.0, 88.0, 70.0]] * 2),
            "bifurcation": (RUN, [[1.0, 0.0, 0.0]] * 2), "boundary_error": (RUN, np.full((2, 3), -1e-6)),
            "shape_error": (RUN, np.full((2, 3), 0.03 * 0.01)), "peak_hold": (RUN, [[0.3, 12.0, 6.0]] * 2),
            "lying_length": (RUN, np.full((2, 3), 0.27)), "rho_a": ("material", [1.0, 1.0]),
            "eta_b": ("material", [3780.0, 3780.0]),
            "touch_error": (("material", "path"), 0.03 * np.array([[0.5, -1.2, 0.7], [-0.5, -0.1, 0.2]])),
            "touch_uncertainty": (("material", "path"), np.full((2, 3), 0.03 * 0.05)),
            "touch_x": (("material", "path"), 0.03 * np.array([[2.6, 2.4, 3.3], [2.6, 2.5, 2.8]])),
            "fell": (("material", "path"), [[1.0, 1.0, 1.0], [0.0, 1.0, 0.0]]),
            "gravity_length": ("material", [0.03, 0.03])},
            {"path": ["r-path", "triangular", "circular"]}),
        "friction": ({
            "ratio_max": (LAW, [[1e-2, 0.0], [2e-2, 0.0]]), "ratio_median": (LAW, [[7e-3, 0.0], [8e-3, 0.0]]),
            "suffices": (LAW, [[0.08, 0.008], [0.1, 0.01]]), "deviation_end": (LAW, 0.03 * np.full((2, 2), 0.01)),
            "touch_x": (LAW, 0.03 * np.full((2, 2), 2.65)), "planned_touch_x": ("material", 0.03 * np.full(2, 2.6)),
            "deviation_max": (LAW, 0.03 * np.full((2, 2), 0.2)),
            "two_ways": ("material", [0.0, 1.0]), "relative_length": ("material", [12.0, 20.0]),
            "gravity_length": ("material", [0.03, 0.03])},
            {"law": ["pull", "hysteresis"]}),
        "friction_steps": ({"suffices": (("law", "step"), [[0.04, 0.08, 0.16], [0.008, 0.0082, 0.008]])},
            {"law": ["pull", "hysteresis"], "step": [0.2, 0.1, 0.05]}),
        "textile_law": ({
            **{name: (("law", "gripper_height"), [[9.0, 12.0], [11.0, 14.0]])
               for name in ("advance", "curvature", "leaves")},
            "path_lost": ("law", [0.66, 0.73]), "measured_curvature": ("row", [1.0, 3.0])},
            {"law": ["secant", "measured"], "gripper_height": [3.0, 5.0]}),
        "disturbed_rpath": ({"touch_error": (("disturbance", "moment"), [[0.2, 0.02, 0.05], [-2.5, 0.3, 0.1]])},
            {"disturbance": ["none", "eta_b +20%"], "moment": [0.0, 0.01, 0.4]}),
        "friction_touch": ({
            "touch_x": (("path", "length", "moment"), [[[2.3, 2.5, 3.0]] * 2, [[3.5, 3.5, 3.6]] * 2]),
            **{name: (("path", "length", "moment"), np.full((2, 2, 3), x))
               for name, x in (("touch_softer", 2.0), ("touch_stiffer", 3.0), ("fell", 0.0))},
            "planned_x": ("length", [2.63, 2.63]), "checked_length": 20.0,
            "checked_x": (("path", "moment"), np.full((2, 3), 2.5))},
            {"path": ["triangular", "circular"], "length": [12.0, 20.0], "moment": [0.0, 0.3, 1.0]}),
        "friction_delay": ({
            "outcome": (("gripper_height", "moment"), [[1.0, 1.0, 0.0, 0.0]] * 2),
            "rise": (("gripper_height", "moment"), [[0.0, 0.05, 1.0, 5.0]] * 2),
            "sag_speed": (("gripper_height", "moment"), [[np.inf, np.inf, 1.0, 0.5]] * 2),
            "coefficient": ("gripper_height", [10.0] * 2), "small_rise": ("gripper_height", [0.0505] * 2),
            "vanishes_below": ("gripper_height", [0.03, 0.1]),
            "checked_rise": ("check", [2.0, 2.02, 2.1]), "fold_height": ("folded", [0.91, 0.93])},
            {"gripper_height": [3.0, 5.0], "moment": [0.0, 0.005, 0.1, 1.0], "folded": [0.1, 0.3],
            "check": ["as above", "half the step", "half kappa_y"]}, {"checked_height": 3.0}),
        "friction_margin": ({"suffices": (("length", "uncertainty"), [[0.01, 0.05], [0.008, 0.09]])},
            {"length": [14.0, 30.0], "uncertainty": [0.0, 0.2]}),
        "fabric_laws": ({
            **{name: (("fabric", "direction", "flattest"), np.ones((2, 2, 2))) for name in ("advance", "snap")},
            **{name: (("fabric", "direction", "flattest", "estimate"), np.ones((2, 2, 2, 4)))
               for name in ("predicted", "gravity_length")},
            **{name: (("fabric", "direction"), np.full((2, 2), 0.1)) for name in ("followed", "friction")}},
            {"flattest": [0.1, 0.3], "estimate": ["mean slope", "slope", "secant", "fold"]}, {"height": 3.0}),
        "fabrics": ({
            "gravity_length": ("fabric", np.full(20, 0.02)), "friction": ("bent", np.linspace(0.1, 0.5, 4))},),
        "random_paths": ({
            "outcome": ("case", OUTCOME.copy()), "critical": ("case", FOUND), "again": ("case", FOUND + 1e-3),
            "message": ("case", texts(*np.where(OUTCOME == "undecided", "NewtonError: no", ""))),
            "spurious_limit_points": ("case", np.where(np.isin(OUTCOME, ["undecided", "refused"]), np.nan, 0.0))},),
        "assess_benchmark": ({"wall": ("repeat", [3.0]), "memory": 150.0, "error": 1e-3},),
        "robot_log_benchmark": ({
            "smooth_wall": ("repeat", [2.0]), "noisy_wall": ("repeat", [2.4]), "smooth_memory": 200.0,
            "noisy_memory": 210.0, "apart": 3e-4},),
        "calibration": ({
            "rms": ("way", [0.18, 0.4]), "view_rms": (("way", "view"), np.full((2, 13), 0.18)), "charuco_rms": 0.21,
            "charuco_corners": 24.0}, {"way": ["scaled", "fixed"]}),
        "strip_looks": ({
            "event": ("case", np.full(24, 0.3001)), "truth": ("case", np.full(24, 0.3)),
            "low": ("case", np.full(24, 0.2998)), "high": ("case", np.full(24, 0.3004))},),
        "camera_bump": ({
            "noticed": ("case", np.ones(30)), "before": ("case", [True, False] * 15),
            "generator": ("case", texts(*["chain", "shapes"] * 15))},),
        "markerless": ({
            "event": ("case", np.full(24, 0.3001)), "truth": ("case", np.full(24, 0.3)),
            "low": ("case", np.full(24, 0.2998)), "high": ("case", np.full(24, 0.3004))},),
        "eta_pictures": ({
            "eta": ("case", np.ones(400)), "low": ("case", [1.001] * 20 + [0.99] * 380), "high": ("case", [1.01] * 400),
            "given": (("method", "picture"), np.zeros((2, 40)))},),
        "centrelines": ({"centreline_rms": 1.3e-4, "centreline_span": 0.2224},),
        # 96 % of the errors are within 1.96 standard deviations.
        "recordings_accuracy": ({
            "event": ("case", 0.3 + 1e-4 * np.concatenate([QUANTILES, np.full(8, np.nan)])),
            "truth": ("case", np.full(209, 0.3)), "sd": ("case", np.full(209, 1e-4)),
            "outcome": ("case", texts(*["measured"] * 201, *["refused"] * 6, *["bound"] * 2)),
            "clock_offset": ("case", 0.2 + 1e-3 * np.concatenate([QUANTILES, np.full(8, np.nan)])),
            "clock_truth": ("case", np.full(209, 0.2)),
            "clock_sd": ("case", 1e-3 * np.append(np.ones(201), np.full(8, np.nan))),
            "sound": ("case", np.append(np.zeros(101), np.ones(108))),
            "generator": ("case", texts(*["chain", "shapes", "shapes"] * 69, "chain", "shapes")),
            **{kind + name: ("case", np.where(np.arange(209) < 90, value, np.nan)) for kind in ("", "fitted_")
               for name, value in (("eta", 1.01), ("low", 0.98), ("high", 1.04), ("moment", 0.02))},
            "flags": ("case", texts(*[""] * 209)), "message": ("case", texts(*[""] * 209))},),
        "recordings": ({
            "snapped": ("recording", np.ones(40)), "lambda_event": ("recording", np.full(40, 0.31)),
            "lambda_zero": ("recording", np.full(40, 0.305)), "lambda_model": ("recording", np.full(40, 0.3))},),
        "conventions": ({"cf_errors": ("file", [0, 0]), "acdd_omissions": ("file", [0, 1])}, {"file": ["a", "b"]}),
        "video_benchmark": ({
            "rate": (("length", "run"), [[100.0] * 3, [161.0, 20.0, 175.0]]), "memory": ("length", [500.0, 501.0]),
            "motion_seconds": ((), 4.0), "render_seconds": ((), 2.0), "measure_seconds": ((), 3.0)},
            {"length": [250, 1000]}),
    }
    # fmt: on
    return {name: xr.Dataset(*parts) for name, parts in made.items()}


def entries(data: dict[str, xr.Dataset]) -> dict:
    return summarise(data, {name: f"{name}.nc" for name in data})


def numbers_of(name: str, data: xr.Dataset) -> dict:
    """Those of one dataset alone."""
    data_of = {**datasets(), name: data}
    chosen = [source for source in SOURCES if name in source.names.split()]
    return {k: e for source in chosen for k, e in evaluate(source, *(data_of[n] for n in source.names.split())).items()}


def test_all_keys_and_all_hold() -> None:
    """Of every number that is stored; those for each eta_m and each program depend on what was run."""
    summary = entries({**datasets(), "project": PROJECT})
    stored = json.loads((ROOT / "results" / "summary.json").read_text(encoding="utf-8"))
    assert {key for key in stored if not key.startswith(("peer_ratio_", "solid_limit_error_"))} <= set(summary) | {
        "claims",
        "claims_open",
    }
    for key, item in summary.items():
        known = {"value", "unit", "statement", "criterion", "holds", "source", "chapter", "datasets"}
        assert known == set(item) - {"error"}, key
        assert item["holds"] is True, key
    assert summary["collapse_deviation"]["datasets"] == ["points", "master"]
    assert summary["collapse_deviation"]["source"] == "points.nc"


def test_of_the_repository() -> None:
    summary = entries({**datasets(), "project": PROJECT})
    assert [summary[key]["value"] for key in ("stale_studies", "package_lines", "ci_seconds")] == [0, 15123, 470.0]
    assert summary["docs_examples"]["value"] == 12
    assert all(summary[key]["holds"] for key in ("stale_studies", "package_lines", "docs_examples", "ci_seconds"))
    late = PROJECT.assign_attrs(stale="lag, falls", docs_examples=11, ci_seconds=481.0)
    summary = entries({**datasets(), "project": late})
    assert summary["stale_studies"]["value"] == 2
    assert summary["stale_studies"]["statement"].endswith("lag, falls")
    assert not summary["stale_studies"]["holds"]
    assert not summary["docs_examples"]["holds"]
    assert not summary["ci_seconds"]["holds"]


def test_a_sample_is_named_by_its_seed() -> None:
    data = datasets()
    assert "seed not stored" in entries(data)["branch_jumps"]["statement"]
    data["branches"].attrs["seed"] = 12
    assert "2000 random strips (seed 12)" in entries(data)["branch_jumps"]["statement"]


@pytest.mark.parametrize(
    ("dataset", "name", "value", "key"),
    [
        ("branches", "verdict", 1, "branch_jumps"),
        ("branches", "verdict", 2, "branch_failures"),
        ("limit", "difference", 1e-2, "solid_limit_error"),
        ("limit", "order", 0.5, "solid_limit_error_1e-04"),
        ("branches", "spurious_limit_points", 1.0, "spurious_limit_points"),
        ("branches", "spurious_limit_points", np.nan, "spurious_limit_points"),
        ("order", "order", 1.0, "order_lambda_c"),
        ("order", "cost_order", 1.5, "order_cost"),
        ("order", "elements", 9000.0, "order_cost"),
        ("low_paths", "finer", "limit point", "low_path_agreement"),
        ("low_paths", "hold", 9.0, "low_path_push"),
        ("low_paths", "time_error", 0.05, "fold_error_low"),
        ("benchmark", "seconds", 6.0, "time_solid_lambda_c"),
        ("benchmark", "relative_error", 6e-3, "time_solid_lambda_c"),
        ("benchmark", "memory", 500.0, "memory_solid_lambda_c"),
        ("rod", "model_error", 2e-3, "rod_model_error"),
        ("cli_benchmark", "wall", 1.2, "time_cli"),
        ("cli_benchmark", "error", 2e-3, "time_cli"),
        ("rod_benchmark", "seconds", 0.2, "time_rod_1e-3"),
        ("rod_benchmark", "estimated_error", 2e-3, "time_rod_1e-3"),
        ("rod_benchmark", "seconds_assess", 2.0, "time_assess_rod"),
        ("rod_benchmark", "seconds_static", 0.2, "time_assess_static_rod"),
        ("rod_benchmark", "apart", 0.01, "time_assess_rod"),
        ("accuracy", "preset_seconds", 1.1, "time_solid_1e-3"),
        ("accuracy", "preset_estimate", 2e-3, "time_solid_1e-3"),
        ("accuracy", "preset_error", -2e-3, "time_solid_1e-3"),
        ("accuracy", "elastica_seconds", 0.03, "time_elastica"),
        ("accuracy", "elastica_error", -1e-8, "time_elastica"),
        ("estimates", "error", 2e-3, "estimate_coverage"),
        ("estimates", "error", np.nan, "estimate_coverage"),
        ("points", "lambda_c", 1.0, "collapse_deviation"),
        ("points", "lambda_error", 0.1, "lambda_c_error_max"),
        ("points", "lambda_c_upper", 1.0, "bracket_max"),
        ("points", "snap", 1.0, "heights_without_snap"),
        ("schemes", "oscillator_order", 1.5, "dynamics_order"),
        ("schemes", "swing_order", np.nan, "dynamics_order"),
        ("schemes", "drift", -1e-3, "dynamics_energy_drift"),
        ("schemes", "drift", np.nan, "dynamics_energy_drift"),
        ("modes", "motion_error", 1e-2, "modes_error"),
        ("lag", "exponent", 0.7, "lag_exponent"),
        ("lag", "exponent_damped", 0.8, "lag_exponent_damped"),
        ("lag", "limit", 11.79, "lag_limit_error"),
        ("falls", "touch_x", np.nan, "falls_failed"),
        ("falls", "touch_x", 0.9, "touch_convergence"),
        ("falls", "minimal_gap", -1e-3, "falls_penetration"),
        ("falls", "closing", 1e-5, "falls_energy_gain"),
        ("falls", "distance", 0.01, "falls_end_state"),
        ("falls", "handed_over", 0.05, "handed_over"),
        ("fall_benchmark", "wall", 25.0, "time_fall"),
        ("fall_benchmark", "memory", 600.0, "memory_fall"),
        ("tangency", "boundary_error", 2e-3, "tangency_error_max"),
        ("tangency", "angle", 5.0, "tangency_angle"),
        ("tangency", "plan_error", 1e-7, "rpath_plan_error"),
        ("assessment", "touch_error", 0.01, "first_touch_triangular"),
        ("assessment", "touch_error", -0.01, "first_touch_circular"),
        # Undecided: within the error, or the error is unknown.
        ("assessment", "touch_uncertainty", 0.022, "first_touch_circular"),
        ("assessment", "touch_uncertainty", 0.004, "first_touch_triangular"),
        ("assessment", "touch_uncertainty", np.nan, "first_touch_circular"),
        ("assessment", "fell", 0.0, "first_touch_circular"),
        ("points", "lambda_c_eigenvalue", 1.0, "detectors_apart"),
        ("points", "detectors_agree", 0.0, "detectors_apart"),
        ("points", "lambda_c", 1.0, "lambda_c_slope"),
        ("points", "thickness", 1.0, "density_factor"),
        ("collapse", "z", 0.03, "collapse_jump"),
        ("collapse", "negatives", 1.0, "collapse_stable_after"),
        ("printed_law", "stiffness_printed", 1.0, "printed_law_stiffness"),
        ("assessment", "critical_points", 0.0, "paths_critical"),
        ("assessment", "boundary_error", np.nan, "path_boundary_error"),
        ("assessment", "boundary_error", -1e-3, "path_boundary_error"),
        ("assessment", "bifurcation", 0.0, "rpath_bifurcations"),
        ("assessment", "critical_angle", 10.0, "snap_angle"),
        ("assessment", "shape_error", 1e-3, "fold_error_frictionless"),
        ("assessment", "touch_error", 0.0, "rpath_touch_frictionless"),
        ("assessment", "peak_hold", 12.0, "hold_over_weight"),
        ("friction", "touch_x", 0.1, "rpath_touch_friction"),
        ("friction", "deviation_max", 0.1, "rpath_deviation"),
        ("friction", "deviation_end", 0.01, "rpath_completed"),
        ("friction", "deviation_end", np.nan, "rpath_completed"),
        ("friction", "ratio_max", 0.2, "friction_ratio_max"),
        ("friction", "two_ways", 0.0, "rpath_two_ways"),
        ("friction", "suffices", 0.2, "friction_moment_max"),
        ("friction_margin", "suffices", 0.2, "friction_margin_exact"),
        ("friction_margin", "suffices", np.nan, "friction_margin_uncertain"),
        ("friction_steps", "suffices", 0.1, "friction_step_k_f"),
        ("friction_delay", "small_rise", 0.06, "delay_law"),
        ("friction_touch", "touch_x", 2.0, "friction_right_triangular"),
        ("disturbed_rpath", "touch_error", 0.5, "disturbed_rpath_error"),
        ("friction_delay", "rise", -0.1, "delay_at_fabric_friction"),
        ("friction_delay", "fold_height", 1.2, "fold_height_friction"),
        ("random_paths", "outcome", "undecided", "random_paths_undecided"),
        ("random_paths", "spurious_limit_points", 1.0, "spurious_limit_points"),
        ("random_paths", "spurious_limit_points", np.nan, "spurious_limit_points"),
        ("hard_cases", "failed", 1.0, "hard_cases_failed"),
        ("hard_cases", "failed", np.nan, "hard_cases_failed"),
        ("assess_benchmark", "wall", 31.0, "time_assess"),
        ("assess_benchmark", "error", 6e-3, "time_assess"),
        ("robot_log_benchmark", "noisy_wall", 3.1, "robot_log_cost"),
        ("robot_log_benchmark", "apart", 2e-3, "robot_log_cost"),
        ("calibration", "rms", 0.26, "calibration_rms"),
        ("calibration", "charuco_rms", 0.26, "charuco_rms"),
        ("strip_looks", "event", np.nan, "strip_looks"),
        ("recordings_accuracy", "eta", 1.031, "eta_motion_error"),
        ("recordings_accuracy", "eta", np.nan, "eta_motion_error"),
        ("recordings_accuracy", "fitted_eta", 1.031, "eta_motion_error_fitted"),
        ("recordings_accuracy", "low", 1.001, "eta_motion_coverage"),
        ("recordings_accuracy", "fitted_high", 0.99, "eta_motion_coverage"),
        ("camera_bump", "noticed", 0.0, "camera_bump"),
        ("camera_bump", "noticed", np.nan, "camera_bump"),
        ("recordings_accuracy", "clock_sd", 4e-4, "clock_coverage"),
        ("recordings_accuracy", "clock_offset", np.nan, "clock_coverage"),
        ("recordings_accuracy", "flags", "warning: the camera moved by 2.0 px", "camera_false_alarms"),
        ("recordings_accuracy", "message", "video: the camera moved by 2.0 px", "camera_false_alarms"),
        ("markerless", "low", 0.30005, "markerless_coverage"),
        ("markerless", "event", np.nan, "markerless_coverage"),
        ("eta_pictures", "low", 0.99, "eta_fold_coverage"),
        ("eta_pictures", "low", np.nan, "eta_fold_coverage"),
        ("eta_pictures", "given", 1.0, "eta_not_fabric"),
        ("centrelines", "centreline_rms", 2.6e-4, "centreline_rms"),
        ("centrelines", "centreline_span", 0.221, "centreline_span"),
        ("recordings_accuracy", "sd", 1e-3, "lambda_coverage"),
        ("recordings_accuracy", "sd", 5e-5, "lambda_coverage"),
        ("recordings_accuracy", "sd", 1.1e-4, "lambda_coverage_50"),
        ("recordings_accuracy", "truth", 0.29985, "lambda_rms_clean"),
        ("recordings_accuracy", "truth", 0.2998, "lambda_bias"),
        ("recordings_accuracy", "truth", 0.31, "recordings_wrong"),
        ("recordings", "lambda_event", 0.299, "measured_above_model"),
        ("recordings", "snapped", 0.0, "measured_above_model"),
        ("video_benchmark", "rate", 149.0, "tracking_rate"),
        ("video_benchmark", "render_seconds", 3.1, "measure_seconds"),
    ],
)
def test_a_criterion_that_is_broken_does_not_hold(dataset: str, name: str, value: float, key: str) -> None:
    data = datasets()[dataset]
    data[name] = xr.full_like(data[name], value)
    assert numbers_of(dataset, data)[key]["holds"] is False


def test_a_slow_dry_run_breaks_its_criterion() -> None:
    data = datasets()["sweeps"].assign_attrs(dry_run=61.0)
    found = numbers_of("sweeps", data)
    assert found["dry_run_seconds"]["holds"] is False
    assert "million strips: 5.6 h and 0.028 h" in found["sweep_cost"]["statement"]


def test_half_written_files_are_a_whole_number() -> None:
    assert "; 0 half-written files left" in numbers_of("kills", datasets()["kills"])["kills_recovered"]["statement"]


@pytest.mark.parametrize(
    ("dataset", "name", "where", "value", "key"),
    [
        ("falls", "minimal_gap", {"case": "fine mesh"}, -1e-3, "falls_penetration"),
        ("falls", "closing", {"case": "no damping"}, 1e-5, "falls_energy_gain"),
        ("falls", "distance", {"case": "half the step"}, 0.01, "falls_end_state"),
        ("falls", "distance", {"case": "other sign"}, 0.01, "falls_end_state"),
        ("falls", "handed_over", {"case": "other sign"}, 0.05, "handed_over"),
        ("falls", "touch_x", {"case": "coarse mesh"}, 0.7701, "touch_convergence"),
        ("falls", "touch_x", {"case": "no damping"}, np.nan, "falls_failed"),
        ("tangency", "boundary_error", {"length": 25.75, "thickness": 0.06}, 2e-3, "tangency_error_max"),
        ("tangency", "boundary_error", {"length": 25.75, "thickness": 0.015}, np.nan, "tangency_error_max"),
        ("tangency", "plan_error", {"length": 21.5}, 1e-7, "rpath_plan_error"),
        ("assessment", "touch_error", {"material": 1, "path": "triangular"}, 0.001, "first_touch_triangular"),
        ("assessment", "touch_error", {"material": 0, "path": "circular"}, -0.001, "first_touch_circular"),
        ("points", "detectors_agree", {"height_index": 7}, 0.0, "detectors_apart"),
        ("assessment", "shape_error", {"material": 1, "path": "circular"}, 3.4e-4, "fold_paths_apart"),
        ("assessment", "touch_x", {"material": 1, "path": "triangular"}, 0.084, "triangular_touch_scaled"),
        ("assessment", "touch_error", {"material": 1, "path": "r-path"}, 0.001, "rpath_touch_frictionless"),
        ("friction", "deviation_end", {"material": 1, "law": "hysteresis"}, 0.01, "rpath_completed"),
        ("friction", "ratio_max", {"material": 1, "law": "pull"}, 0.2, "friction_ratio_max"),
        ("friction_steps", "suffices", {"law": "hysteresis", "step": 0.1}, 0.02, "friction_step_M_0"),
        ("calibration", "view_rms", {"way": "scaled", "view": 3}, 0.6, "calibration_rms"),
        ("video_benchmark", "memory", {"length": 1000}, 600.0, "tracking_memory"),
        ("recordings_accuracy", "event", {"case": 0}, 0.302, "recordings_wrong"),
        ("effects", "clocked", {"scene": "calm", "effect": "self_contact"}, 0.06, "effects_overhead"),
        ("effects", "matters", {"scene": "calm", "effect": "self_contact"}, 1.0, "effects_overhead"),
        ("effects", "cost", {"scene": "wild", "effect": "layers"}, 0.07, "effects_overhead"),
        ("effects", "needed", {"scene": "calm", "effect": "self_contact"}, np.nan, "effects_undetected"),
        ("effects", "reported", {"scene": "wild", "effect": "self_contact"}, 0.0, "effects_undetected"),
        ("kills", "went_on", {"kill": 3}, 0.0, "kills_recovered"),
        ("kills", "differs", {"kill": 3}, "figures/order.png", "kills_recovered"),
        ("kills", "left", {"kill": 30}, 1.0, "kills_recovered"),
        ("commands", "differs", {"command": "film x"}, "film.mp4", "repeat_bitwise"),
        ("fuzz", "failed", {"kind": "data"}, 1, "fuzz_failures"),
        ("fuzz", "refused", {"kind": "yaml"}, 6999, "fuzz_inputs"),
        ("wheels", "failed", {"environment": "3.11 lowest", "command": "eta"}, "error", "wheel_commands"),
        ("sweeps", "results", {"model": "rod"}, 1023, "sweep_scenes"),
        ("sweeps", "apart", {"model": "elastica"}, 1e-8, "sweep_scenes"),
        ("sweeps", "wall", {"model": "elastica"}, 201.0, "sweep_rate"),
        ("sweeps", "cost", {"model": "elastica"}, 0.005, "sweep_cost"),
        ("folding_plans", "path", {"case": 7}, "failed", "plan_cases"),
        ("folding_plans", "safe", {"case": 7}, 0.0, "plan_safe"),
        ("folding_plans", "confirmed", {"case": 299}, 0.0, "plan_none"),
        ("folding_plans", "seconds", {"case": slice(0, 200)}, 2.1, "plan_seconds"),
        ("folding_plans", "still_seconds", {"case": 7}, 5.1, "plan_still_seconds"),
        ("folding_plans", "speed_seconds", {"case": 7}, 5.1, "plan_speed_seconds"),
        ("random_paths", "outcome", {"case": slice(3, 5)}, "undecided", "random_paths_undecided"),
        ("hard_cases", "failed", {"case": 7}, 1.0, "hard_cases_failed"),
        ("branches", "spurious_limit_points", {"case": 7}, 1.0, "spurious_limit_points"),
        ("low_paths", "rod", {"case": 7}, "failed", "low_path_agreement"),
        ("low_paths", "rod", {"case": 7}, "limit point", "low_path_stable"),
        ("low_paths", "solid", {"case": 7}, "limit point", "low_path_limit_points"),
        ("low_paths", "rod", {"case": 7}, "failed", "low_path_cases"),
        ("low_paths", "time_error", {"mu": 0.6}, np.nan, "fold_error_low"),
        ("order", "order", {"model": "solid"}, 2.9, "order_lambda_c"),
        ("conventions", "cf_errors", {"file": "b"}, 1, "cf_errors"),
        ("knocks", "fell", {"distance": 0.02}, 1.2, "knock_threshold"),
        ("knocks", "away", {"distance": 0.1}, 0.5, "knock_return"),
        ("knocks", "away", {"distance": 0.02}, 1e-4, "knock_return"),
        ("explorer", "error", {"place": 7}, 3e-3, "explorer_error"),
        ("variants", "lambda_end_shift", {"variant": "Poisson's ratio 0.45"}, 0.01, "variant_poisson"),
        ("eigenvalues", "eigenvalue_1", {"motion": "x", "step": 3}, 1e-2, "eigenvalue_at_critical"),
        ("eigenvalues", "eigenvalue_1", {"motion": "circular", "step": 0}, 5e-2, "eigenvalue_exponent"),
        ("second_gripper", "chosen_gain", {"gripper_height": 5.0}, 8.9, "second_gripper_snaps"),
        ("second_gripper", "chosen_gain", {"gripper_height": 5.0}, np.nan, "second_gripper_snaps"),
        ("second_gripper", "gain", {"gripper_height": 5.0, "place": 3}, np.nan, "second_gripper_snaps"),
        ("stability_map", "error", {"length": 12.0}, 2e-6, "map_boundary_error"),
        ("stability_map", "rod", {"thickness": 0.03}, 8.98, "map_rod_difference"),
        ("barrier", "barrier", {"gripper_height": 3.0, "distance": 1e-4}, 1.0803e-6, "barrier_coefficient"),
        ("layer_friction", "error", {"path": "circular", "mu": 0.2}, 0.05, "fold_error_mu"),
        ("layer_friction", "error", {"path": "r-path", "mu": 0.1}, 0.2, "fold_error_mu"),
        ("layer_friction", "created", {"path": "circular", "mu": 0.2}, 2e-6, "layer_friction_energy"),
        ("barrier", "work", {"gripper_height": 2.0, "distance": 1e-4}, 1.0801e-6, "barrier_coefficient"),
        ("barrier", "model_coefficient", {"model": "rod", "gripper_height": 3.0}, 1.05, "barrier_coefficient"),
    ],
)
def test_one_bad_value_is_enough(dataset: str, name: str, where: dict, value: float | str, key: str) -> None:
    data = datasets()[dataset]
    data[name].loc[where] = value
    assert numbers_of(dataset, data)[key]["holds"] is False


@pytest.mark.parametrize(
    ("dataset", "count", "key"),
    [
        ("falls", 5, "falls"),
        ("hard_cases", 24, "hard_cases"),
        ("folding_plans", 149, "plan_cases"),
        ("random_paths", 199, "random_paths"),
        ("estimates", 299, "estimate_coverage"),
        ("branches", 1999, "branch_cases"),
        ("branches", 499, "spurious_limit_points"),
        ("low_paths", 39, "low_path_agreement"),
        ("low_paths", 199, "low_path_cases"),
        ("low_paths", 99, "low_path_stable"),
        ("recordings_accuracy", 199, "recordings"),
        ("recordings_accuracy", 199, "lambda_coverage"),
    ],
)
def test_a_smaller_sample_does_not_hold(dataset: str, count: int, key: str) -> None:
    assert numbers_of(dataset, datasets()[dataset].isel(case=slice(0, count)))[key]["holds"] is False


def test_recordings_with_a_warning_refused_or_all_refused() -> None:
    data = datasets()["recordings_accuracy"]
    data["event"][0], data["flags"][:101] = 0.302, "warning: fast"
    found = numbers_of("recordings_accuracy", data)
    assert [found[key]["value"] for key in ("recordings_wrong", "recordings_wrong_all", "recordings_flagged")] == [
        0,
        1,
        0,
    ]
    assert found["recordings_wrong"]["holds"] is found["recordings_flagged"]["holds"] is True
    data["flags"][:] = "note: frames are missing in 1 places"
    found = numbers_of("recordings_accuracy", data)
    assert found["recordings_wrong"]["holds"] is False
    assert found["recordings_flagged"]["value"] == 0.0
    data["flags"][101:] = "warning: fast"
    assert numbers_of("recordings_accuracy", data)["recordings_flagged"]["holds"] is False
    # Far off, and within an interval that says so.
    data["sd"][0] = 2e-3
    assert numbers_of("recordings_accuracy", data)["recordings_wrong"]["holds"] is True
    data["outcome"][:30] = "refused"
    assert numbers_of("recordings_accuracy", data)["recordings_failed"]["holds"] is False
    data["outcome"][:] = "refused"
    found = numbers_of("recordings_accuracy", data)
    for key in ("lambda_coverage", "lambda_coverage_50", "lambda_rms_clean", "lambda_bias", "recordings_flagged"):
        assert found[key]["holds"] is False


def test_strips_laid_down_do_not_count_as_falls() -> None:
    data = datasets()["assessment"]
    data["touch_error"][{"material": 1, "path": 2}] = -0.03
    found = numbers_of("assessment", data)["first_touch_circular"]
    assert (found["holds"], found["value"], found["error"]) == (True, pytest.approx(0.7), pytest.approx(0.05))
    assert "do not count: -1.00" in found["statement"]
    assert quoted(found) == "0.7 +- 0.05 L*"


def test_the_finest_step_the_smaller_order_and_the_median_are_quoted() -> None:
    data = datasets()
    modes = data["modes"].isel(steps=[0, 0]).assign_coords(steps=[25, 100])
    modes["motion_error"][..., 0] = 0.07
    assert numbers_of("modes", modes)["modes_error"]["value"] == pytest.approx(7e-4)
    data["schemes"]["swing_order"] += 0.5
    assert numbers_of("schemes", data["schemes"])["dynamics_order"]["value"] == 1.99
    falls = xr.Dataset({"wall": ("repeat", [8.0, 11.0, 30.0]), "memory": ((), 150.0)})
    assert numbers_of("fall_benchmark", falls)["time_fall"]["value"] == 11.0


def test_scenes_without_a_number_count_as_outside_of_their_estimate() -> None:
    data = datasets()["estimates"]
    data["error"][:15] = np.nan
    assert numbers_of("estimates", data)["estimate_coverage"]["value"] == pytest.approx(0.95)
    data["error"][15] = 2e-3
    assert numbers_of("estimates", data)["estimate_coverage"]["holds"] is False


def test_refused_scenes_count_neither_way_but_may_not_be_many() -> None:
    data = datasets()["estimates"]
    for refused, holds in ((45, True), (46, False)):
        data["outcome"][:refused] = "refused"
        found = numbers_of("estimates", data)["estimate_coverage"]
        assert (found["value"], found["holds"]) == (1.0, holds)
        assert f"{refused} were refused" in found["statement"]


def test_statements_name_what_was_found() -> None:
    data = datasets()
    found = entries(data)
    assert found["effects_overhead"]["value"] == 0.02
    assert "self_contact +2.0%, layers +1.0%" in found["effects_overhead"]["statement"]
    assert "86 jobs; most time: record 53%, measure 36%, assess 11%" in found["time_all"]["statement"]
    data["hard_cases"]["failed"][7] = 1.0
    assert numbers_of("hard_cases", data["hard_cases"])["hard_cases_failed"]["statement"].endswith("case 7")
    data["cold_run"].attrs["wall"] = 301.0
    assert numbers_of("cold_run", data["cold_run"])["time_all"]["holds"] is False


def test_table_is_replaced_and_nothing_else() -> None:
    summary = {key: item | {"fresh": True} for key, item in entries(datasets()).items()}
    begin, end = markers("numbers")
    text = "before\n" + begin + "old\n" + end + "after\n"
    filled = fill_table(text, "numbers", markdown(summary))
    assert filled == "before\n" + begin + markdown(summary) + end + "after\n"
    assert fill_table(filled, "numbers", markdown(summary)) == filled


def test_a_stale_number_is_printed_as_stale_and_holds_nothing(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(numbers, "why_stale", lambda data, parameters: data.attrs.get("changed", ""))
    data = {name: found.assign_attrs(git_commit="abc") for name, found in datasets().items() if name != "project"}
    data["branches"].attrs["changed"] = "the code has changed"
    sources = {name: f"{name}.nc" for name in data}
    path = tmp_path / "summary.json"
    output = SimpleNamespace(data=path, page=tmp_path / "summary.html")
    numbers.summary(sources, {"branches": {}, "limit": {}}, str(tmp_path), output, lambda line: None, **data)
    assert output.page.read_text(encoding="utf-8").count("<td>stale</td>") == 4
    summary = json.loads(path.read_text(encoding="utf-8"))
    assert {key for key, item in summary.items() if not item["fresh"]} == {
        "branch_cases",
        "branch_jumps",
        "branch_failures",
        "spurious_limit_points",
    }
    assert not summary["branch_cases"]["holds"]
    assert summary["order_lambda_c"]["holds"]
    assert summary["order_lambda_c"]["commit"] == "abc"
    assert summary["stale_studies"]["value"] == 1
    assert "branches" in summary["stale_studies"]["statement"]
    assert not summary["stale_studies"]["holds"]
    rows = {row.split("`")[1]: row for row in markdown(summary).splitlines()[2:]}
    assert rows["branch_cases"].endswith("| stale |")
    assert rows["order_lambda_c"].endswith("| yes |")


def test_a_number_of_no_cases_is_stored_as_none(tmp_path: Path) -> None:
    """JSON has no word for nan, and a share of nothing meets no criterion."""
    data = datasets()["recordings_accuracy"]
    data["sound"][:] = 0.0
    found = numbers_of("recordings_accuracy", data)
    for key in ("lambda_rms_clean", "recordings_flagged"):
        assert found[key]["value"] is None
        assert found[key]["holds"] is False
    data["outcome"][:] = "refused"
    found |= numbers_of("recordings_accuracy", data)
    assert found["lambda_sd"]["value"] is None  # it has no criterion
    assert found["lambda_sd"]["holds"] is False
    store.write_json(found, tmp_path / "summary.json")
    assert "| no number |" in markdown({"lambda_sd": found["lambda_sd"] | {"fresh": True}})
    timed = xr.Dataset({"wall": ("repeat", [3.0]), "memory": 150.0, "error": np.nan})
    assert numbers_of("assess_benchmark", timed)["time_assess"]["holds"] is False


def test_physics_tables_have_the_stored_numbers_in_order() -> None:
    data = (
        datasets()["friction_delay"]
        .assign(vanishes_above=("gripper_height", [0.02, np.nan]))
        .isel(gripper_height=[1, 0])
    )
    assert physics_tables.delay(data).splitlines() == [
        r"| z / L\* | 3 | 5 |",
        "|---|---|---|",
        r"| C / L\* | 10.00 | 10.00 |",
        "| largest M_0 with a snap | 0.02 | - |",
        "| least M_0 without one | 0.03 | 0.1 |",
    ]


def test_presets_one_row_each() -> None:
    data = datasets()["accuracy"]
    data["preset_seconds"].loc[{"asked": "auto", "accuracy": 1e-2, "gripper_height": 9.0}] = 2.0
    data["preset_model"].loc[{"asked": "auto", "accuracy": 1e-2, "gripper_height": 9.0}] = "rod"
    rows = presets(data).splitlines()[2:]
    assert len(rows) == 4
    assert rows[0] == "| 1e-02 | `auto` | elastica, rod | 2 s | 5e-04 | 2e-04 |"


def test_texts_quote_what_is_stored() -> None:
    summary = json.loads((ROOT / "results" / "summary.json").read_text(encoding="utf-8"))
    names = {"accuracy", "profiling", "hard_cases", "effects", "peers", "cold_run"}
    names |= {study for study, _ in physics_tables.TABLES.values()}
    kept = {name: store.read(ROOT / "results" / "studies" / f"{name}.nc") for name in names}
    for path, tables in numbers.pages(summary, kept).items():
        text = (ROOT / path).read_text(encoding="utf-8")
        for name, table in tables.items():
            assert fill_table(text, name, table) == text, "run `snakemake readme`"
    assert gallery_markdown() == (ROOT / "docs/figures.md").read_text(encoding="utf-8"), "run `snakemake readme`"
    examples = (ROOT / "docs/examples.md").read_text(encoding="utf-8")
    assert numbers.examples_markdown() == examples, "run `snakemake readme`"
    assert examples.count("```python") == len(list((ROOT / "examples").glob("*.py")))


def test_material_examples_run() -> None:
    assert doctest.testmod(stripfold.base.material).failed == 0


def test_pages_show_figures_that_exist() -> None:
    shown = {
        part.split(")")[0]
        for page in (ROOT / "README.md", *(ROOT / "docs").glob("*.md"))
        for part in page.read_text(encoding="utf-8").split("figures/")[1:]
        if ")" in part[:60]
    }
    assert len(shown) >= 20
    missing = [name for name in shown if name.endswith((".png", ".mp4")) and not (ROOT / "figures" / name).is_file()]
    assert not missing
    gallery = (ROOT / "docs/figures.md").read_text(encoding="utf-8")
    assert all(f"(../figures/{path.name})" in gallery for path in (ROOT / "figures").glob("*.png"))
