"""``stripfold plan``: a path for a robot, as a table, as JSON and as a page."""

from __future__ import annotations

import argparse

from stripfold.cli_commands import STRIP, Say, _given, _lines, _options, _output
from stripfold.json_output import as_json


def options(parser: argparse.ArgumentParser) -> None:
    from stripfold.inputs import FoldingPlan

    _options(parser, FoldingPlan, (*STRIP, "eta_m", "rho_a", "eta_b_uncertainty", "margin"))
    text = FoldingPlan.model_fields["layers_may_slide"].description
    parser.add_argument("--layers-may-slide", action="store_true", help=text)
    _options(parser, FoldingPlan, ("speed", "acceleration"))
    parser.add_argument("--csv", metavar="PATH.csv", help="write the path there: t,x,z,angle in s, m, m and degrees")
    text = "the plan with the path as one JSON object: printed, or written there"
    parser.add_argument("--json", nargs="?", const=True, metavar="PLAN.json", help=text)


def plan(arguments: argparse.Namespace, say: Say) -> str:
    from stripfold.inputs import FoldingPlan as Asked

    # Checked before anything is computed.
    given = {kind: getattr(arguments, kind) for kind in ("csv", "json")}
    targets = {kind: _output(name, "", f".{kind}") for kind, name in given.items() if isinstance(name, str)}
    asked = Asked(**_given(arguments, Asked))
    from stripfold.folding_plan import FoldingPlan

    found = FoldingPlan.of(asked, say)
    writers = {"csv": found.to_csv, "json": found.to_json}
    for kind, target in targets.items():
        writers[kind](target)
    if arguments.json is True:
        return as_json(found.to_dict())
    return f"{found}\n{_lines([('written', str(target)) for target in targets.values()])}".rstrip()
