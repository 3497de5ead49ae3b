"""``stripfold plan``: a path for a robot, as a table, as JSON and as a page."""

from __future__ import annotations

import argparse

from stripfold.base.errors import InvalidInputError
from stripfold.base.extras import require
from stripfold.cli_commands import STRIP, _draw, _given, _lines, _options, _output, _plot_file, _plot_option
from stripfold.cli_messages import Say
from stripfold.files.json_output import as_json

FILES = {"csv": ".csv", "json": ".json", "report": ".html"}
"""Options that name a file, and how its name ends."""


def options(parser: argparse.ArgumentParser) -> None:
    from stripfold.ask.inputs import FoldingPlan

    _options(parser, FoldingPlan, (*STRIP, "eta_m", "rho_a", "eta_b_uncertainty", "margin"))
    text = FoldingPlan.model_fields["layers_may_slide"].description
    parser.add_argument("--layers-may-slide", action="store_true", help=text)
    text = "M_0 of the fabric's bending hysteresis, N, and its kappa_y, 1/m [0.05 / L*]: the R-path needs friction"
    parser.add_argument("--friction-moment", metavar="M0[,KAPPA_Y]", help=text)
    _options(parser, FoldingPlan, ("speed", "acceleration"))
    parser.add_argument("--csv", metavar="PATH.csv", help="write the path there: t,x,z,angle in s, m, m and degrees")
    text = "the plan with the path as one JSON object: printed, or written there"
    parser.add_argument("--json", nargs="?", const=True, metavar="PLAN.json", help=text)
    text = "write a page there: map, path, margin along the path, worst case, reasons"
    parser.add_argument("--report", metavar="PLAN.html", help=text)
    _plot_option(parser, "the strip along the path")


def plan(arguments: argparse.Namespace, say: Say) -> str:
    from stripfold.ask.inputs import FoldingPlan as Asked

    # Checked before anything is computed.
    asked_for = {kind: suffix for kind, suffix in FILES.items() if isinstance(getattr(arguments, kind), str)}
    targets = {suffix: _output(arguments, kind, suffix, "") for kind, suffix in asked_for.items()}
    if arguments.report is not None:
        require("plot")
    drawing = _plot_file(arguments)
    asked = Asked(**_given(arguments, Asked) | _friction(arguments.friction_moment))
    from stripfold.ask.folding_plan import FoldingPlan

    found = FoldingPlan.of(asked, say)
    writers = {".csv": found.to_csv, ".json": found.to_json, ".html": found.report}
    for suffix, target in targets.items():
        writers[suffix](target)
    _draw(found, drawing)
    if arguments.json is True:
        return as_json(found.to_dict())
    return f"{found}\n{_lines([('written', str(target)) for target in targets.values()])}".rstrip()


def _friction(given: str | None) -> dict[str, float]:
    """M_0 and kappa_y from ``M0`` or ``M0,KAPPA_Y``."""
    if given is None:
        return {}
    try:
        return dict(zip(("friction_moment", "yield_curvature"), map(float, given.split(",", 1)), strict=False))
    except ValueError as error:
        allowed = "M_0 in N, or M_0 and kappa_y in 1/m with a comma between them"
        raise InvalidInputError("friction_moment", given, allowed) from error
