"""The study of plans: what it draws, and that its checks find what is wrong."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from stripfold import paths
from stripfold.base.errors import NoPathError, SolveError
from studies import folding_plans as study

SEED = 5


def test_cases_are_the_same_for_the_same_numbers() -> None:
    first, again, other = (study.case(number, SEED) for number in (3, 3, 4))
    assert first == again != other
    assert first.eta_b_uncertainty == 0.2


def test_an_unsafe_path_and_a_false_reason_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    strip = study.FoldingPlan(length=0.5, eta_b=3780.0, margin=0.01, layers_may_slide=True)
    assert "lost with eta_b" in study.unsafe(strip, paths.triangular(strip), False)
    assert study.unsafe(strip, paths.low(strip, 0.03), False) == ""
    names = ("low", "triangular", "r-path")
    refused = NoPathError("", [SimpleNamespace(path=name, reason="") for name in names])
    assert study.unconfirmed(strip, refused) == ("low",)
    short = study.FoldingPlan(length=0.25, eta_b=3780.0, margin=0.001)
    assert study.unconfirmed(short, refused) == ("triangular",)
    assert study.unconfirmed(study.FoldingPlan(length=0.25, eta_b=3780.0, margin=0.03), refused) == ()
    # The whole case, with a planner that knows nothing.
    monkeypatch.setattr(study, "case", lambda *_: strip)

    def none(_: object) -> None:
        raise refused

    monkeypatch.setattr(study, "choose", none)
    row = study.numbered(0, SEED)
    assert (row["path"], row["confirmed"], row["message"]) == ("none", 0.0, "low")

    def fails(_: object) -> None:
        raise ValueError("no")

    monkeypatch.setattr(study, "choose", fails)
    assert study.numbered(0, SEED)["path"] == "failed"


def test_a_failed_solve_confirms_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the strips without one, one that is lost does."""
    asked = study.FoldingPlan(length=0.5, eta_b=3780.0, margin=0.01)
    lost: set[float] = set()

    def follows(_: object, strip: study.Strip, *__: object) -> bool:
        if strip.eta_b == asked.strips[2].eta_b:
            raise SolveError("planted")
        return strip.eta_b not in lost

    monkeypatch.setattr(study, "follows", follows)
    monkeypatch.setattr(study, "_verdict", lambda *_: SimpleNamespace(shape_error=0.0))
    assert not study._no_r_path(asked)
    lost.add(asked.strips[0].eta_b)
    assert study._no_r_path(asked)


def test_study() -> None:
    found = study.run(3, SEED)
    assert set(found.path.values) <= {"low", "triangular", "r-path", "none"}
    planned = found.path.values != "none"
    assert (found.safe.values[planned] == 1.0).all()
    assert (found.confirmed.values[~planned] == 1.0).all()
