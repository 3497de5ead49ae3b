"""The numbers that are quoted, and the README that quotes them."""

from __future__ import annotations

import doctest
import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import stripfold.material
from stripfold import store
from studies.accuracy import presets
from studies.plots import gallery_markdown
from studies.random_paths import CONTRADICTED
from studies.schemes import CONSERVING, DEFAULT
from studies.summary.run import fill_table, markdown, markers, summarise
from tasks import numbers

ROOT = Path(__file__).parents[1]


def datasets() -> dict[str, xr.Dataset]:
    """Small datasets in which every criterion holds."""
    z = np.linspace(2.0, 12.0, 41)
    points = xr.Dataset(
        {
            "height": (("material", "height_index"), 0.03 * z[None]),
            "lambda_c": (("material", "height_index"), 0.03 * (z[None] + 7.0)),
            "lambda_error": (("material", "height_index"), np.full((1, 41), 1e-5)),
            "lambda_c_lower": (("material", "height_index"), 0.03 * (z[None] + 7.0)),
            "lambda_c_upper": (("material", "height_index"), 0.03 * (z[None] + 7.0)),
            "snap": (("material", "height_index"), np.where(z[None] > 2.0, 1.0, 0.0)),
            "gravity_length": ("material", [0.03]),
        }
    )
    master = xr.Dataset({"lambda_c": ("z", z + 7.0)}, {"z": z}, {"touch_limit": 1.58617085})
    eta_m = np.array([1e-3, 1e-4])
    limit = xr.Dataset(
        {
            "difference": (("eta_m", "refinement"), np.array([[2e-4], [2e-5]])),
            "mesh_error": ("eta_m", [1e-6, 1e-6]),
            "order": ("eta_m", [np.nan, 1.0]),
            "lambda_c_elastica": ((), 9.856908),
        },
        {"eta_m": eta_m},
        {"height_star": 3.0},
    )
    order = xr.Dataset({"order": ((), 2.0), "error": ("size", [1e-2, 1e-3])})
    verdicts = xr.Dataset({"verdict": ("case", np.zeros(2000, int))})
    benchmark = xr.Dataset({"seconds": ("repeat", [1.0]), "relative_error": ("repeat", [1e-3]), "memory": ((), 200.0)})
    scheme = xr.Dataset(
        {
            "oscillator_order": ("scheme", [1.99, 2.0]),
            "swing_order": ("scheme", [1.98, 2.0]),
            "drift": ("scheme", [1e-9, 1e-9]),
            "numerical_share": ("scheme", [0.01, 0.0]),
            "contact_share": ("scheme", [0.02, 0.02]),
        },
        {"scheme": [DEFAULT, CONSERVING], "swing_step": [0.4, 0.2]},
    )
    modes = xr.Dataset(
        {
            "motion_error": (("gravity", "mode", "steps"), np.full((2, 3, 1), 7e-4)),
            "solid_error": (("gravity", "mode"), np.full((2, 3), 4e-4)),
        },
        {"steps": [100]},
        {"length_star": 3.0, "elements": 24},
    )
    lag = xr.Dataset({"lambda_c": ((), 11.7821)}, attrs={"air": 1.0})
    for suffix, theory in (("", 0.8), ("_damped", 2.0 / 3.0)):
        lag[f"speed{suffix}"] = [1e-3, 1e-2]
        lag[f"lag{suffix}"] = lag[f"expected{suffix}"] = (f"speed{suffix}", [0.01, 0.06])
        lag[f"exponent{suffix}"], lag[f"exponent_half_width{suffix}"] = theory - 0.01, 0.005
        lag[f"theory{suffix}"], lag[f"limit{suffix}"] = theory, 11.7824
    cases = ["base", "half the step", "other sign", "coarse mesh", "fine mesh", "no damping"]
    falls = xr.Dataset(
        {
            "touch_x": ("case", [0.77, 0.77, 0.77, 0.775, 0.7705, 0.78]),
            "minimal_gap": ("case", np.zeros(6)),
            "closing": ("case", np.full(6, 1e-12)),
            "distance": ("case", np.full(6, 1e-5)),
            "handed_over": ("case", [1e-4] * 5 + [np.nan]),
        },
        {"case": cases},
    )
    rod = xr.Dataset(
        {
            "model_error": (("height", "thickness"), [[5e-3, 4e-5]]),
            "mesh_error": (("model", "height", "thickness"), np.full((2, 1, 2), 1e-4)),
            "lambda_c": (("model", "height", "thickness"), np.full((2, 1, 2), 9.8)),
        },
        {"thickness": [0.2, 0.0594], "model": ["rod", "solid"]},
    )
    rod_benchmark = xr.Dataset(
        {
            "seconds": ("repeat", [0.09]),
            "estimated_error": ((), 8e-4),
            "seconds_assess": ("repeat", [0.9]),
            "apart": ((), 1e-3),
        }
    )
    return {
        **of_paths(),
        "rod": rod,
        "rod_benchmark": rod_benchmark,
        **of_pictures(),
        **of_accuracy(),
        "effects": of_effects(),
        "cold_run": xr.Dataset(
            {"seconds": ("rule", [300.0, 200.0, 60.0, 1.0]), "jobs": ("rule", [40.0, 40.0, 5.0, 1.0])},
            {"rule": np.array(["record", "measure", "assess", "plans"], dtype=object)},
            {"wall": 290.0, "cores": 2},
        ),
        "falls": falls,
        "fall_benchmark": xr.Dataset({"wall": ("repeat", [8.0]), "memory": ((), 150.0)}),
        "schemes": scheme,
        "modes": modes,
        "lag": lag,
        "points": points,
        "master": master,
        "limit": limit,
        "order": order,
        "branches": verdicts,
        "benchmark": benchmark,
    }


def of_paths() -> dict[str, xr.Dataset]:
    """The datasets of folding paths."""
    where = ("length", "thickness")
    tangency = xr.Dataset(
        {
            "boundary_error": (where, np.full((5, 2), -1e-4)),
            "angle": (where, np.tile([8.0, 2.0], (5, 1))),
            "plan_error": ("length", np.full(5, 1e-12)),
            "elastica_error": ("length", np.full(5, -1e-13)),
        },
        {"length": np.linspace(13.0, 30.0, 5), "thickness": [0.06, 0.015]},
    )
    names = ["r-path", "triangular", "circular"]
    assessment = xr.Dataset(
        {
            "touch_error": (("material", "path"), 0.03 * np.array([[0.0, -1.2, 0.7], [0.0, -0.1, 0.2]])),
            "fell": (("material", "path"), [[1.0, 1.0, 1.0], [0.0, 1.0, 0.0]]),
            "gravity_length": ("material", [0.03, 0.03]),
        },
        {"path": names},
    )
    of_law = ("material", "law")
    friction = xr.Dataset(
        {
            "ratio_max": (of_law, [[1e-2, 0.0], [2e-2, 0.0]]),
            "ratio_median": (of_law, [[7e-3, 0.0], [8e-3, 0.0]]),
            "suffices": (of_law, [[0.08, 0.008], [0.1, 0.01]]),
            "deviation_end": (of_law, 0.03 * np.full((2, 2), 0.01)),
            "two_ways": ("material", [0.0, 1.0]),
            "relative_length": ("material", [12.0, 20.0]),
            "gravity_length": ("material", [0.03, 0.03]),
        },
        {"law": ["pull", "hysteresis"]},
    )
    steps = xr.Dataset(
        {"suffices": (("law", "step"), [[0.04, 0.08, 0.16], [0.008, 0.0082, 0.008]])},
        {"law": ["pull", "hysteresis"], "step": [0.2, 0.1, 0.05]},
    )
    outcome = np.array(["stable"] * 100 + ["critical"] * 80 + ["refused"] * 15 + ["undecided"] * 5, dtype=object)
    found = np.where(outcome == "critical", 10.0, np.nan)
    random = xr.Dataset({"outcome": ("case", outcome), "critical": ("case", found), "again": ("case", found + 1e-3)})
    random["message"] = ("case", np.where(outcome == "undecided", "NewtonError: no", "").astype(object))
    benchmark = xr.Dataset({"wall": ("repeat", [12.0]), "memory": ((), 150.0), "error": ((), 1e-3)})
    hard = xr.Dataset(
        {
            "name": ("case", np.array([f"case {i}" for i in range(40)], dtype=object)),
            "failed": ("case", np.zeros(40)),
            "outcome": ("case", np.array(["value"] * 30 + ["NewtonError"] * 10, dtype=object)),
        }
    )
    return {
        "hard_cases": hard,
        "tangency": tangency,
        "assessment": assessment,
        "friction": friction,
        "friction_steps": steps,
        "random_paths": random,
        "assess_benchmark": benchmark,
    }


def of_accuracy() -> dict[str, xr.Dataset]:
    """The datasets of accuracy against time."""
    over = ("asked", "accuracy", "height")
    names = np.array([["elastica", "rod"], ["solid", "solid"]], dtype=object)
    accuracy = xr.Dataset(
        {
            "preset_seconds": (over, np.full((2, 2, 2), 0.9)),
            "preset_estimate": (over, np.full((2, 2, 2), 5e-4)),
            "preset_error": (over, np.full((2, 2, 2), -2e-4)),
            "preset_model": (over, np.repeat(names[..., None], 2, axis=2)),
            "elastica_seconds": ("height", [0.015, 0.02]),
            "elastica_error": ("height", [1e-12, -1e-12]),
            "snaps": ("height", [1, 1]),
        },
        {"asked": ["auto", "solid"], "accuracy": [1e-2, 1e-3], "height": [3.0, 9.0]},
    )
    estimates = xr.Dataset(
        {
            "asked": ("case", np.array(["auto", "solid", "rod"] * 100, dtype=object)),
            "estimate": ("case", np.full(300, 1e-3)),
            "error": ("case", np.full(300, 5e-4)),
        }
    )
    return {"accuracy": accuracy, "estimates": estimates}


def of_effects() -> xr.Dataset:
    """Two scenes: the first needs inertia only, the second self-contact as well."""
    over = ("scene", "effect")
    needed = np.array([[0.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
    return xr.Dataset(
        {
            "needed": (over, needed),
            "reported": (over, needed.copy()),
            "matters": (over, needed.copy()),
            "cost": (over, np.array([[0.07, 0.4, -0.01], [0.3, 0.5, 0.01]])),
            "clocked": (over, np.array([[0.02, np.nan, np.nan], [0.2, np.nan, np.nan]])),
        },
        {"scene": ["calm", "wild"], "effect": ["self_contact", "inertia", "membrane"]},
    )


def of_pictures() -> dict[str, xr.Dataset]:
    """The datasets of pictures and recordings."""
    views = np.full((2, 13), 0.18)
    calibration = xr.Dataset(
        {
            "rms": ("way", [0.18, 0.4]),
            "view_rms": (("way", "view"), views),
            "charuco_rms": ((), 0.21),
            "charuco_corners": ((), 24.0),
        },
        {"way": ["scaled", "fixed"]},
    )
    centrelines = xr.Dataset({"centreline_rms": ((), 1.3e-4), "centreline_span": ((), 0.2224)})
    z = np.linspace(-1.0, 1.0, 201) * 2.04  # 96 % within 1.96
    outcome = np.array(["measured"] * 201 + ["refused"] * 10 + ["bound"] * 2, dtype=object)
    accuracy = xr.Dataset(
        {
            "event": ("case", 0.3 + 1e-4 * np.concatenate([z, np.full(12, np.nan)])),
            "truth": ("case", np.full(213, 0.3)),
            "sd": ("case", np.full(213, 1e-4)),
            "outcome": ("case", outcome),
            "flags": ("case", np.full(213, "", dtype=object)),
        }
    )
    recordings = xr.Dataset(
        {
            "snapped": ("recording", np.ones(40)),
            "lambda_event": ("recording", np.full(40, 0.31)),
            "lambda_zero": ("recording", np.full(40, 0.305)),
            "lambda_model": ("recording", np.full(40, 0.3)),
        }
    )
    benchmark = xr.Dataset(
        {
            "rate": (("codec", "length", "run"), [[[70.0] * 3, [71.0, 20.0, 75.0]], [[30.0] * 3, [31.0] * 3]]),
            "memory": (("codec", "length", "run"), np.full((2, 2, 3), [[[500.0], [501.0]]])),
        },
        {"codec": ["h264", "ffv1"], "length": [60, 240]},
    )
    return {
        "calibration": calibration,
        "centrelines": centrelines,
        "recordings_accuracy": accuracy,
        "recordings": recordings,
        "video_benchmark": benchmark,
    }


def entries(data: dict[str, xr.Dataset]) -> dict:
    return summarise(data, {name: f"{name}.nc" for name in data})


def test_all_keys_and_all_hold() -> None:
    """Of every number that is stored; those for each eta_m and each program depend on what was run."""
    summary = entries(datasets())
    stored = json.loads((ROOT / "results" / "summary.json").read_text(encoding="utf-8"))
    assert {key for key in stored if not key.startswith(("peer_ratio_", "solid_limit_error_"))} <= set(summary)
    for key, item in summary.items():
        assert {"value", "unit", "statement", "criterion", "holds", "source", "datasets"} == set(item), key
        assert item["holds"] is True, key
    assert summary["collapse_deviation"]["datasets"] == ["points", "master"]
    assert summary["collapse_deviation"]["source"] == "points.nc"


def test_of_the_repository() -> None:
    project = xr.Dataset(attrs={"stale": "", "studies": 28, "package_lines": 15123, "ci_seconds": 470.0})
    summary = entries({**datasets(), "project": project})
    assert [summary[key]["value"] for key in ("stale_studies", "package_lines", "ci_seconds")] == [0, 15123, 470.0]
    assert all(summary[key]["holds"] for key in ("stale_studies", "package_lines", "ci_seconds"))
    late = project.assign_attrs(stale="lag, falls", ci_seconds=481.0)
    summary = entries({**datasets(), "project": late})
    assert summary["stale_studies"]["value"] == 2
    assert summary["stale_studies"]["statement"].endswith("lag, falls")
    assert not summary["stale_studies"]["holds"]
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
        ("order", "order", 1.0, "order_lambda_c"),
        ("benchmark", "seconds", 6.0, "time_solid_lambda_c"),
        ("benchmark", "relative_error", 6e-3, "time_solid_lambda_c"),
        ("benchmark", "memory", 500.0, "memory_solid_lambda_c"),
        ("rod", "model_error", 2e-3, "rod_model_error"),
        ("rod_benchmark", "seconds", 0.2, "time_rod_1e-3"),
        ("rod_benchmark", "estimated_error", 2e-3, "time_rod_1e-3"),
        ("rod_benchmark", "seconds_assess", 2.0, "time_assess_rod"),
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
        ("assessment", "fell", 0.0, "first_touch_circular"),
        ("friction", "deviation_end", 0.01, "rpath_completed"),
        ("friction", "deviation_end", np.nan, "rpath_completed"),
        ("friction", "ratio_max", 0.2, "friction_ratio_max"),
        ("friction", "two_ways", 0.0, "rpath_two_ways"),
        ("friction", "suffices", 0.2, "friction_moment_max"),
        ("friction_steps", "suffices", 0.1, "friction_step_k_f"),
        ("random_paths", "message", CONTRADICTED, "random_paths_undecided"),
        ("random_paths", "message", "", "random_paths_undecided"),
        ("hard_cases", "failed", 1.0, "hard_cases_failed"),
        ("hard_cases", "failed", np.nan, "hard_cases_failed"),
        ("assess_benchmark", "wall", 31.0, "time_assess"),
        ("assess_benchmark", "error", 6e-3, "time_assess"),
        ("calibration", "rms", 0.26, "calibration_rms"),
        ("calibration", "charuco_rms", 0.26, "charuco_rms"),
        ("centrelines", "centreline_rms", 2.6e-4, "centreline_rms"),
        ("centrelines", "centreline_span", 0.221, "centreline_span"),
        ("recordings_accuracy", "sd", 1e-3, "lambda_coverage"),
        ("recordings_accuracy", "sd", 5e-5, "lambda_coverage"),
        ("recordings_accuracy", "truth", 0.2998, "lambda_bias"),
        ("recordings_accuracy", "truth", 0.31, "recordings_wrong"),
        ("recordings", "lambda_event", 0.299, "measured_above_model"),
        ("recordings", "snapped", 0.0, "measured_above_model"),
        ("video_benchmark", "rate", 59.0, "tracking_rate"),
    ],
)
def test_a_criterion_that_is_broken_does_not_hold(dataset: str, name: str, value: float, key: str) -> None:
    data = datasets()
    data[dataset][name] = xr.full_like(data[dataset][name], value)
    assert entries(data)[key]["holds"] is False


@pytest.mark.parametrize(
    ("name", "case", "value", "key"),
    [
        ("minimal_gap", "fine mesh", -1e-3, "falls_penetration"),
        ("closing", "no damping", 1e-5, "falls_energy_gain"),
        ("distance", "half the step", 0.01, "falls_end_state"),
        ("distance", "other sign", 0.01, "falls_end_state"),
        ("handed_over", "other sign", 0.05, "handed_over"),
        ("touch_x", "coarse mesh", 0.7701, "touch_convergence"),
        ("touch_x", "no damping", np.nan, "falls_failed"),
    ],
)
def test_one_bad_fall_is_enough(name: str, case: str, value: float, key: str) -> None:
    data = datasets()
    data["falls"][name].loc[{"case": case}] = value
    assert entries(data)[key]["holds"] is False


@pytest.mark.parametrize(
    ("dataset", "name", "where", "value", "key"),
    [
        ("tangency", "boundary_error", {"length": 3, "thickness": 0}, 2e-3, "tangency_error_max"),
        ("tangency", "boundary_error", {"length": 3, "thickness": 1}, np.nan, "tangency_error_max"),
        ("tangency", "plan_error", {"length": 2}, 1e-7, "rpath_plan_error"),
        ("assessment", "touch_error", {"material": 1, "path": 1}, 0.001, "first_touch_triangular"),
        ("assessment", "touch_error", {"material": 0, "path": 2}, -0.001, "first_touch_circular"),
        ("friction", "deviation_end", {"material": 1, "law": 1}, 0.01, "rpath_completed"),
        ("friction", "ratio_max", {"material": 1, "law": 0}, 0.2, "friction_ratio_max"),
        ("friction_steps", "suffices", {"law": 1, "step": 1}, 0.02, "friction_step_M_0"),
    ],
)
def test_one_bad_path_is_enough(dataset: str, name: str, where: dict[str, int], value: float, key: str) -> None:
    data = datasets()
    data[dataset][name][where] = value
    assert entries(data)[key]["holds"] is False


def test_one_bad_picture_or_recording_is_enough() -> None:
    data = datasets()
    data["calibration"]["view_rms"][0, 3] = 0.6
    assert entries(data)["calibration_rms"]["holds"] is False
    data = datasets()
    data["recordings_accuracy"]["event"][0] = 0.302
    assert entries(data)["recordings_wrong"]["holds"] is False
    data["recordings_accuracy"]["flags"][0] = "too fast"
    assert entries(data)["recordings_wrong"]["holds"] is True
    data["recordings_accuracy"]["outcome"][:30] = "refused"
    assert entries(data)["recordings_failed"]["holds"] is False
    data = datasets()
    data["recordings_accuracy"] = data["recordings_accuracy"].isel(case=slice(20, None))
    found = entries(data)
    assert found["recordings"]["holds"] is found["lambda_coverage"]["holds"] is False
    data["recordings_accuracy"]["outcome"][:] = "refused"
    found = entries(data)
    assert not any(found[key]["holds"] for key in ("lambda_coverage", "lambda_bias", "recordings_failed"))
    data = datasets()
    data["video_benchmark"]["memory"][0, 1] = 600.0
    assert entries(data)["tracking_memory"]["holds"] is False


def test_what_is_laid_down_does_not_count_as_a_fall() -> None:
    data = datasets()
    data["assessment"]["touch_error"][{"material": 1, "path": 2}] = -0.03
    found = entries(data)["first_touch_circular"]
    assert found["holds"] is True
    assert found["value"] == pytest.approx(0.7)
    assert "do not count: -1.00" in found["statement"]


def test_too_few_random_paths_or_too_many_undecided() -> None:
    data = datasets()
    data["random_paths"] = data["random_paths"].isel(case=slice(1, None))
    found = entries(data)
    assert found["random_paths"]["holds"] is False
    assert found["random_paths_undecided"]["value"] == 5
    data = datasets()
    data["random_paths"]["outcome"][:21] = "undecided"
    assert entries(data)["random_paths_undecided"]["holds"] is False
    data = datasets()
    data["random_paths"]["message"][-1] = CONTRADICTED
    assert entries(data)["random_paths_undecided"]["holds"] is False


def test_too_few_hard_cases_or_one_that_failed() -> None:
    data = datasets()
    data["hard_cases"]["failed"][7] = 1.0
    found = entries(data)
    assert found["hard_cases_failed"]["holds"] is False
    assert found["hard_cases_failed"]["value"] == 1
    assert found["hard_cases_failed"]["statement"].endswith("case 7")
    data["hard_cases"] = data["hard_cases"].isel(case=slice(0, 24))
    assert entries(data)["hard_cases"]["holds"] is False


def test_five_falls_are_too_few() -> None:
    data = datasets()
    data["falls"] = data["falls"].isel(case=slice(0, 5))
    assert entries(data)["falls"]["holds"] is False


def test_the_finest_step_the_smaller_order_and_the_median_are_quoted() -> None:
    data = datasets()
    data["modes"] = data["modes"].isel(steps=[0, 0]).assign_coords(steps=[25, 100])
    data["modes"]["motion_error"][..., 0] = 0.07
    data["schemes"]["swing_order"] += 0.5
    data["fall_benchmark"] = xr.Dataset({"wall": ("repeat", [8.0, 11.0, 30.0]), "memory": ((), 150.0)})
    found = entries(data)
    assert found["modes_error"]["value"] == pytest.approx(7e-4)
    assert found["dynamics_order"]["value"] == 1.99
    assert found["time_fall"]["value"] == 11.0


def test_coverage_counts_what_has_no_number() -> None:
    data = datasets()
    data["estimates"]["error"][:15] = np.nan
    assert entries(data)["estimate_coverage"]["value"] == pytest.approx(0.95)
    data["estimates"]["error"][15] = 2e-3
    assert entries(data)["estimate_coverage"]["holds"] is False


def test_effects_that_cost_or_matter_or_are_not_told() -> None:
    found = entries(datasets())
    assert found["effects_overhead"]["value"] == 0.02
    assert "self_contact +2.0%, membrane +1.0%" in found["effects_overhead"]["statement"]
    assert found["effects_undetected"]["value"] == 0
    for name, value, key in (
        ("clocked", 0.06, "effects_overhead"),
        ("matters", 1.0, "effects_overhead"),
        ("needed", np.nan, "effects_undetected"),
    ):
        data = datasets()
        data["effects"][name][{"scene": 0, "effect": 0}] = value
        assert entries(data)[key]["holds"] is False, name
    data = datasets()
    data["effects"]["cost"][{"scene": 1, "effect": 2}] = 0.07
    assert entries(data)["effects_overhead"]["holds"] is False
    data = datasets()
    data["effects"]["reported"][{"scene": 1, "effect": 0}] = 0.0
    found = entries(data)["effects_undetected"]
    assert (found["value"], found["holds"]) == (1, False)


def test_a_whole_run_that_takes_longer() -> None:
    data = datasets()
    data["cold_run"].attrs["wall"] = 301.0
    found = entries(data)["time_all"]
    assert (found["value"], found["holds"]) == (301.0, False)
    assert "86 jobs; most time: record 53%, measure 36%, assess 11%" in found["statement"]


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
    numbers.summary(sources, {"branches": {}, "limit": {}}, [path], lambda line: None, **data)
    summary = json.loads(path.read_text(encoding="utf-8"))
    assert {key for key, item in summary.items() if not item["fresh"]} == {
        "branch_cases",
        "branch_jumps",
        "branch_failures",
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


def test_presets_one_row_each() -> None:
    data = datasets()["accuracy"]
    data["preset_seconds"].loc[{"asked": "auto", "accuracy": 1e-2, "height": 9.0}] = 2.0
    data["preset_model"].loc[{"asked": "auto", "accuracy": 1e-2, "height": 9.0}] = "rod"
    rows = presets(data).splitlines()[2:]
    assert len(rows) == 4
    assert rows[0] == "| 1e-02 | `auto` | elastica, rod | 2 s | 5e-04 | 2e-04 |"


def test_texts_quote_what_is_stored() -> None:
    summary = json.loads((ROOT / "results" / "summary.json").read_text(encoding="utf-8"))
    names = ("accuracy", "profiling", "hard_cases", "effects", "peers", "cold_run")
    kept = {name: store.read(ROOT / "results" / "studies" / f"{name}.nc") for name in names}
    for path, tables in numbers.pages(summary, kept).items():
        text = (ROOT / path).read_text(encoding="utf-8")
        for name, table in tables.items():
            assert fill_table(text, name, table) == text, "run `snakemake readme`"
    assert gallery_markdown() == (ROOT / "docs/figures.md").read_text(encoding="utf-8"), "run `snakemake readme`"


def test_readme_and_material_examples_run() -> None:
    assert doctest.testfile(str(ROOT / "README.md"), module_relative=False).failed == 0
    assert doctest.testmod(stripfold.material).failed == 0


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
