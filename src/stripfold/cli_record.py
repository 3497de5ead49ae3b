"""The command that makes a synthetic recording."""

from __future__ import annotations

import argparse
from pathlib import Path

from stripfold.cli_common import progress
from stripfold.errors import InvalidInputError


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the parser."""
    record = commands.add_parser(
        "record",
        help="a synthetic recording: film, calibration, log and truth",
        description="Render a strip's motion as a camera would film it, with the calibration of that camera.",
        allow_abbrev=False,
    )
    record.add_argument("scene", metavar="SCENE.yaml", help="strip, gripper, filming, and where the motion comes from")
    record.add_argument("--output", metavar="FOLDER", help="where to write [the scene's name, here]")


def record(arguments: argparse.Namespace) -> str:
    """``stripfold record``."""
    from stripfold.synthetic import recording, scene

    asked = scene.read(arguments.scene)
    folder = Path(arguments.output or Path(arguments.scene).stem)
    if folder.exists():
        raise InvalidInputError("output", str(folder), "a folder that is not there yet", "remove it, or choose another")
    if not folder.parent.is_dir():
        raise InvalidInputError("output", str(folder), "a path in an existing folder", f"make {folder.parent} first")
    with progress() as say:
        say("motion")
        history = recording.history_of(asked)
        say("film")
        recording.write_recording(history, asked, folder)
    critical = history.lambda_c
    lines = [
        ("written", f"{folder} (synthetic)"),
        ("length", f"{history.t[-1]:.4g} s"),
        ("lambda_c", "-" if critical is None else f"{critical:.6g} m  (static, known)"),
    ]
    return "\n".join(f"{name:<12} {text}" for name, text in lines)
