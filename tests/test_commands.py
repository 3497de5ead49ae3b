"""The study of repeated commands: it calls them all, and sees what differs."""

from __future__ import annotations

import pytest

from stripfold.cli import COMMANDS
from studies import commands
from studies.commands import Outcome


def test_all_commands_are_called() -> None:
    assert {line.split()[0] for line in commands.COMMANDS} == set(COMMANDS)


@pytest.mark.parametrize(
    ("other", "differs"),
    [
        (Outcome("said", 0, {"a": "1", "b": "2"}), ""),
        (Outcome("other", 0, {"a": "1", "b": "2"}), "what is printed"),
        (Outcome("said", 2, {"a": "1", "b": "2"}), "what is printed"),
        (Outcome("said", 0, {"a": "1", "b": "3"}), "b"),
        (Outcome("said", 0, {"a": "1"}), "b"),
        (Outcome("said", 0, {"a": "1", "b": "2", "c": "3"}), "c"),
    ],
)
def test_differences(other: Outcome, differs: str) -> None:
    assert commands.differences([Outcome("said", 0, {"a": "1", "b": "2"}), other]) == differs


def test_a_failed_command_is_none_that_repeats() -> None:
    failed = Outcome("error", 2, {})
    assert commands.differences([failed, failed]) == "failed: error"


def test_of_what_is_printed_the_run_time_may_differ(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(commands, "COMMANDS", ("path r-path --length 0.5 --eta-b 3780", "eta --fold-height 0.0272"))
    data = commands.run(repeats=2)
    assert data["differs"].values.tolist() == ["", ""]
    assert commands._RUN_TIME.sub("", "a\ntime         0.12 s\nb") == "a\n\nb"
