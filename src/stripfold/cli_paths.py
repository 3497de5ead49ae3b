"""The commands about gripper paths: plan one, assess one."""

from __future__ import annotations

import argparse
from time import perf_counter
from typing import TYPE_CHECKING, Any

from stripfold.cli_common import as_json, metres, output_path, progress

if TYPE_CHECKING:
    from stripfold.analysis.verdict import Verdict
    from stripfold.inputs import Strip

KINDS = ("r-path", "triangular", "circular")


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the commands to the parser."""
    path = commands.add_parser(
        "path",
        help="the gripper's path of a half fold",
        description="Plan a folding path and print it as t,x,z: pseudo time, metres, origin mid-strip on the floor.",
        allow_abbrev=False,
    )
    path.add_argument("kind", choices=KINDS, help="which path")
    _strip_arguments(path)
    path.add_argument("--csv", metavar="FILE.csv", help="write it there instead of printing it")

    assess = commands.add_parser(
        "assess",
        help="what a path does to a strip",
        description="Follow a path statically to its critical points, let the strip fall there, and go on to its end.",
        allow_abbrev=False,
    )
    assess.add_argument("path", metavar="PATH.csv", help="t,x,z as stripfold path writes it")
    _strip_arguments(assess)
    number = assess.add_argument
    number("--eta-m", type=float, default=1e-3, metavar="X", help="weight-to-membrane-stiffness ratio, m^-2 s^2 [1e-3]")
    number("--nu", type=float, default=0.0, metavar="X", help="Poisson's ratio [0]")
    number("--rho-a", type=float, default=1.0, metavar="X", help="areal density, kg m^-2; scales forces only [1]")
    number("--model", choices=("solid", "rod"), default="solid", help="the paper's finite elements, or a rod [solid]")
    law = assess.add_mutually_exclusive_group()
    law.add_argument("--friction", type=float, metavar="K", help="the paper's internal friction k_f, s^-2")
    law.add_argument("--hysteresis", type=float, metavar="M", help="moment M_0 of a bending hysteresis, N")
    number("--step", type=float, metavar="M", help="size of the steps with friction, m [0.1 L*]")
    assess.add_argument("--json", action="store_true", help="print one JSON object")


def _strip_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--length", type=float, required=True, metavar="M", help="length of the strip, m")
    parser.add_argument(
        "--eta-b", type=float, required=True, metavar="X", help="weight-to-bending-stiffness ratio, m^-4 s^2"
    )


def _strip(arguments: argparse.Namespace) -> Strip:
    from stripfold.inputs import UNSTRETCHED, Strip

    # A path is planned for a strip that hardly stretches: that command has no eta_m.
    return Strip(length=arguments.length, eta_b=arguments.eta_b, eta_m=UNSTRETCHED)


def path(arguments: argparse.Namespace) -> str:
    """``stripfold path``."""
    from stripfold.paths import PLANS

    planned = PLANS[arguments.kind](_strip(arguments))
    if arguments.csv is None:
        return planned.as_text().rstrip()
    target = output_path(arguments.csv, arguments.csv, ".csv")
    planned.to_csv(target)
    return f"written      {target}, {len(planned.places)} rows"


def assess(arguments: argparse.Namespace) -> str:
    """``stripfold assess``."""
    from stripfold.analysis import verdict
    from stripfold.inputs import PathAssessment
    from stripfold.paths import table

    began = perf_counter()
    keys = ("length", "eta_b", "eta_m", "nu", "rho_a", "model", "friction", "hysteresis", "step")
    asked = PathAssessment(**{key: getattr(arguments, key) for key in keys})
    own = table.read(arguments.path, asked.length_star, asked.gravity_length)
    friction = {key: getattr(asked, key) for key in ("friction", "hysteresis", "step")}
    with progress() as say:
        found = verdict.assess_path(asked.material, asked.length, own, model=asked.model, progress=say, **friction)
    seconds = perf_counter() - began
    return as_json(_fields(found, seconds)) if arguments.json else _as_text(found, seconds)


def _fields(found: Verdict, seconds: float) -> dict[str, Any]:
    return {
        "stable": found.stable,
        "critical": [dict(event) for event in found.critical],
        "first_touch_x": found.first_touch_x,
        "planned_touch_x": found.planned_touch_x,
        "touch_error": found.touch_error,
        "shape_error": found.shape_error,
        "lying_length": found.lying_length,
        "peak_force": found.peak_force,
        "peak_hold": found.peak_hold,
        "completed": found.completed,
        "seconds": seconds,
    }


def _as_text(found: Verdict, seconds: float) -> str:
    lines = [("stable", "yes" if found.stable else "no")]
    lines += [
        (
            "critical",
            f"t = {event['t']:.4g}, gripper at x = {event['x']:.4g} m, z = {event['z']:.4g} m: {event['kind']}",
        )
        for event in found.critical
    ]
    lines += [
        ("first touch", metres(found.first_touch_x, "x, origin mid-strip")),
        ("  planned", metres(found.planned_touch_x, "x where the folded state lands")),
        ("  error", metres(found.touch_error, "negative: short of it")),
        ("shape error", metres(found.shape_error, "largest distance of the last state from the folded one")),
        ("lying", metres(found.lying_length, "length from the held end in the last state")),
        ("peak force", f"{found.peak_force:.4g} N/m  (gripper, per width)"),
        ("peak hold", f"{found.peak_hold:.4g} N/m  (horizontal, at the held end)"),
        ("completed", "yes" if found.completed else "no"),
        ("time", f"{seconds:.1f} s"),
    ]
    return "\n".join(f"{name:<12} {text}" for name, text in lines)
