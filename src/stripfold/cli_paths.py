"""The commands of gripper paths and places: path, map, assess."""

from __future__ import annotations

import argparse

from stripfold.base.errors import MISSING, InvalidInputError
from stripfold.base.extras import require
from stripfold.cli_commands import (
    SHEET,
    STRIP,
    _asked_output,
    _draw,
    _given,
    _json_option,
    _lines,
    _option,
    _options,
    _plot_file,
    _plot_option,
    _said,
    _second_gripper_option,
    metres,
)
from stripfold.cli_messages import Say, logger
from stripfold.files.json_output import as_json, document


def _fold_option(parser: argparse.ArgumentParser) -> None:
    text = "distance of the fold line from the gripped end, m [half the length]"
    parser.add_argument("--fold-at", type=metres, metavar="M", help=text)


TOO_LOW, TOO_HIGH = 0.44, 0.02
"""Distance of the first touch on an R-path from the planned one where the plan's eta_b is 5 % too low and too high, L*:
a strip without friction, study disturbed_rpath (docs/physics.md, section 9)."""


def safe_side(gravity_length: float) -> str:
    """On which side an R-path should be planned where eta_b is not known well."""
    low, high = (1e3 * gravity_length * share for share in (TOO_LOW, TOO_HIGH))
    cost = f"an eta_b 5 % too low moves the first touch by {low:.2g} mm, one 5 % too high by {high:.2g} mm"
    return f"plan an R-path for the largest eta_b that the strip may have: without friction {cost}"


def path_options(parser: argparse.ArgumentParser) -> None:
    from stripfold.ask.inputs import Strip

    parser.add_argument("kind", choices=("r-path", "triangular", "circular", "low"), help="which path")
    _options(parser, Strip, STRIP)
    parser.add_argument("--height", type=metres, metavar="M", help="of the gripper on the low path, m")
    _fold_option(parser)
    parser.add_argument("--csv", metavar="FILE.csv", help="write it there instead of printing it")
    _plot_option(parser, "the path")
    _json_option(parser)


def path(arguments: argparse.Namespace, say: Say) -> str:
    from stripfold.ask.inputs import UNSTRETCHED, Strip
    from stripfold.paths import PLANS, low

    # A path is planned for a strip that hardly stretches: this command has no eta_m.
    strip, height = Strip(**_given(arguments, Strip), eta_m=UNSTRETCHED), arguments.height
    if (arguments.kind == "low") != (height is not None):
        raise InvalidInputError("height", MISSING if height is None else height, "a height with the low path only")
    drawing = _plot_file(arguments)
    target = _asked_output(arguments, "csv", ".csv")
    fold_at = arguments.fold_at
    planned = PLANS[arguments.kind](strip, fold_at) if height is None else low(strip, height, fold_at)
    if arguments.kind == "r-path":
        logger.info(safe_side(strip.gravity_length))
    _draw(planned, drawing)
    if target is not None:
        planned.to_csv(target)
    if arguments.json:
        return as_json(document(planned.to_dict(), {**_given(arguments, Strip), "fold_at": fold_at}))
    if target is None:
        return planned.as_text().rstrip()
    return _lines([("written", f"{target}, {len(planned.places)} rows")])


def map_options(parser: argparse.ArgumentParser) -> None:
    from stripfold.ask.inputs import StabilityMap

    _options(parser, StabilityMap, (*STRIP, "rho_a", "friction_moment"))
    parser.add_argument("--output", metavar="MAP.nc", help="write it there")
    _plot_option(parser, "the map")
    _json_option(parser)


def map_places(arguments: argparse.Namespace, say: Say) -> str:
    from stripfold.ask import inputs

    data = _asked_output(arguments, "output", ".nc")
    target = _plot_file(arguments)
    asked = inputs.StabilityMap(**_given(arguments, inputs.StabilityMap), eta_m=inputs.UNSTRETCHED)
    from stripfold.ask.stability_map import StabilityMap

    found = StabilityMap.of(asked, say)
    if data is not None:
        found.to_netcdf(data)
    _draw(found, target)
    return _said(found, arguments)


def assess_options(parser: argparse.ArgumentParser) -> None:
    from stripfold.ask.inputs import PathAssessment

    parser.add_argument("path", metavar="PATH.csv", help="t,x,z as stripfold path writes it")
    _options(parser, PathAssessment, (*STRIP, *SHEET, "rho_a", "model"))
    _fold_option(parser)
    log = parser.add_argument_group("a robot's log")
    log.add_argument("--columns", metavar="T,X,Z", help="names or numbers of its columns of time, x and z")
    log.add_argument("--unit", metavar="m|cm|mm", help="of its positions [as its header says, or m]")
    text = "the point under the middle of the strip in its frame, m; flip: its x runs against the folding; --frame=-1,0"
    log.add_argument("--frame", metavar="X0,Z0[,flip]", help=text)
    text = "largest distance of the path from the rows of a log with noise, m"
    log.add_argument("--smooth", type=metres, metavar="M", help=text)
    parser.add_argument("--fall", action="store_true", help=PathAssessment.model_fields["fall"].description)
    law = parser.add_mutually_exclusive_group()
    _option(law, PathAssessment, "friction_moment")
    _option(law, PathAssessment, "pull")
    _options(parser, PathAssessment, ("layer_friction", "step"))
    _second_gripper_option(parser)
    text = "write the verdict with all states there"
    parser.add_argument("--output", metavar="RESULT.nc", help=text)
    _plot_option(parser, "the strip along the path")
    parser.add_argument("--film", metavar="FILM.mp4", help="where to draw it as a film, with the falls")
    text = (
        "exit with code 1 where the strip does not follow all of the path, is not folded at its end (5 mm, 5 %% of the "
        "length), or does not follow it on another mesh"
    )
    parser.add_argument("--check", action="store_true", help=text)
    _json_option(parser)


def assess(arguments: argparse.Namespace, say: Say) -> tuple[str, int]:
    from time import perf_counter

    from stripfold.ask import inputs

    began = perf_counter()
    asked = inputs.PathAssessment(**_given(arguments, inputs.PathAssessment))
    from stripfold import paths
    from stripfold.ask.path_assessment import PathAssessment

    log = {name: getattr(arguments, name) for name in ("columns", "unit", "frame", "smooth", "fold_at")}
    path, target = paths.read(arguments.path, asked, **log), _plot_file(arguments)
    if arguments.film is not None:
        require("vision")
    film = _asked_output(arguments, "film", ".mp4")
    for warning in path.curve.warnings:
        logger.warning(warning)
    data = _asked_output(arguments, "output", ".nc")
    found = PathAssessment.of(asked, path, began, say)
    if data is not None:
        found.to_netcdf(data)
    _draw(found, target)
    if film is not None:
        found.film(film, say)
    passed = found.stable and found.folded and not found.mesh_dependence
    return _said(found, arguments), 1 if arguments.check and not passed else 0
