"""Studies of paths, small: what they store is what they say."""

from __future__ import annotations

import numpy as np
import pytest

from stripfold.base.errors import SolveError
from stripfold.follow import assess
from stripfold.follow.contact_branch import Planned
from stripfold.follow.static import StripModel
from stripfold.paths import geometric, rpath
from studies import random_paths, rpaths
from tasks import friction


def test_tangency() -> None:
    data = rpaths.run_tangency([14.0], [0.06], 1.0)
    assert abs(float(data["boundary_error"][0, 0])) < 2e-3
    assert float(data["plan_error"][0]) < 1e-9
    assert abs(float(data["elastica_error"][0])) < 1e-9
    assert 2.0 < float(data["angle"][0, 0]) < assess.LARGEST_BIFURCATION_ANGLE
    assert float(data["bifurcation"][0, 0]) == 1.0
    # The solid is critical a little before the elastica, on the way over.
    assert float(data["x"][0, 0]) == pytest.approx(float(data["planned_x"][0]), abs=0.3)
    assert float(data["z"][0, 0]) > float(data["planned_z"][0])
    x, z = data["x"].values[0, 0], data["z"].values[0, 0]
    path = rpath.plan_r_path(14.0).path
    s = np.linspace(path.pieces[1].start, path.pieces[1].end, 2000)
    near = min(np.hypot(*(path.position(float(value)) - [x, z])) for value in s)
    assert near < 2e-3


def test_friction_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Brackets and touches end up under their own law and step."""

    def smallest(mesh: Planned, plan: rpath.RPath, law: str, step: float) -> tuple[float, friction.Run]:
        strength, is_pull = 10.0 * step, law == "pull"
        touch = plan.first_touch + strength + (0.5 if is_pull else 0.0)
        return (1.0 if is_pull else 2.0), friction.Run(law, strength, step, (), (), touch)

    plan = rpath.plan_r_path(12.0)
    monkeypatch.setattr(rpaths, "smallest", smallest)
    data = rpaths.run_friction_steps(12.0, 0.06, [0.2, 0.1], 3.0)
    assert data["fails"].values.tolist() == [[1.0, 1.0], [2.0, 2.0]]
    np.testing.assert_allclose(data["suffices"], [[2.0, 1.0], [2.0, 1.0]])
    np.testing.assert_allclose(data["touch_error"], [[2.5, 1.5], [2.0, 1.0]])
    assert data["law"].values.tolist() == list(friction.LAWS)
    assert plan.first_touch > 2.0


def test_random_cases_are_of_all_kinds() -> None:
    found = [random_paths.case(number, 3) for number in range(40)]
    again = random_paths.case(7, 3)
    np.testing.assert_array_equal(found[7].rows, again.rows)
    assert again.strip == found[7].strip
    assert {case.kind for case in found} == {"smooth", "corners"}
    below = sum(bool((case.rows[:, 2] < 0.0).any()) for case in found)
    beyond = sum(
        bool((np.hypot(case.rows[1:, 1] - case.strip.length / 2, case.rows[1:, 2]) > case.strip.length).any())
        for case in found
    )
    assert below >= 1
    assert beyond >= 1
    assert below + beyond <= 12
    for case in found:
        np.testing.assert_allclose(case.rows[0, 1:], [-case.strip.length / 2.0, 0.0])


@pytest.mark.parametrize("number", range(8))
def test_smooth_paths_have_no_corners_and_the_others_have(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The largest turn between neighbouring rows vanishes with their distance, or stays."""

    def largest_turn() -> float:
        x, z = np.diff(random_paths.case(number, 3).rows[:, 1:], axis=0).T
        return float(np.abs(np.diff(np.unwrap(np.arctan2(z, x)))).max())

    coarse = largest_turn()
    monkeypatch.setattr(random_paths, "ROWS_PER_SEGMENT", 64 * random_paths.ROWS_PER_SEGMENT)
    fine = largest_turn()
    if random_paths.case(number, 3).kind == "smooth":
        assert fine < 0.2 * coarse
    else:
        assert fine == coarse > 0.5


class Assessed:
    """What an assessment says, made up."""

    def __init__(self, travelled: float | None) -> None:
        event = type("Event", (), {"travelled": travelled, "angle": 80.0})()
        self.events = () if travelled is None else (event,)
        self.stable, self.touch, self.contact = travelled is None, None, "moving"


@pytest.mark.parametrize(
    ("runs", "outcome"),
    [
        ((None, None), "stable"),
        ((3.0, 3.001), "critical"),
        ((3.0, 3.2), "undecided"),
        ((None, 3.0), "undecided"),
        ((3.0, None), "undecided"),
        ((None, SolveError("no")), "undecided"),
    ],
)
def test_outcomes_once(runs: tuple[object, object], outcome: str, monkeypatch: pytest.MonkeyPatch) -> None:
    said, sizes = iter(runs), []

    def assess_strip(strip: StripModel, path: object, **given: object) -> Assessed:
        sizes.append((given["refinement"], getattr(given.get("options"), "largest", None)))
        answer = next(said)
        if isinstance(answer, Exception):
            raise answer
        return Assessed(answer)  # type: ignore[arg-type]

    monkeypatch.setattr(random_paths, "assess_strip", assess_strip)
    path = geometric.triangular(12.0)
    s, places = path.sampled(1.0)
    case = random_paths.Case("corners", StripModel(12.0, 0.05), np.column_stack([s, places]))
    row = random_paths.outcome(case, 2.0)
    assert row["outcome"] == outcome
    failed = any(isinstance(one, Exception) for one in runs)
    assert np.isnan(row["spurious_limit_points"]) == failed
    assert row["spurious_limit_points"] == 1.0 or failed or runs not in ((3.0, 3.2), (3.0, None))
    # The second run is another one: other elements, shorter steps.
    assert sizes[1][0] < sizes[0][0]
    assert sizes[1][1] == pytest.approx(0.5 * random_paths.STEPS.largest)
    assert np.isnan(row["critical"]) == (runs[0] is None or isinstance(runs[1], Exception))


def test_a_touch_where_the_other_run_is_critical_is_a_close_call(monkeypatch: pytest.MonkeyPatch) -> None:
    stable, critical = Assessed(None), Assessed(3.0)
    stable.touch = type("Touch", (), {"travelled": 3.02})()  # type: ignore[assignment]
    said = iter((stable, critical, critical, stable))
    monkeypatch.setattr(random_paths, "assess_strip", lambda *given, **asked: next(said))
    case = random_paths.Case("corners", StripModel(12.0, 0.05), np.array([[0.0, -6.0, 0.0], [1.0, 0.0, 4.0]]))
    assert random_paths.outcome(case, 2.0)["outcome"] == "close"
    stable.touch.travelled = 3.2
    assert random_paths.outcome(case, 2.0)["outcome"] == "undecided"


def test_a_run_stores_its_seed_and_its_cases(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(random_paths, "assess_strip", lambda *given, **asked: Assessed(3.0))
    data = random_paths.run(4, 3, 2.0)
    assert (data.attrs["seed"], data.attrs["refinement"]) == (3, 2.0)
    assert data["case"].values.tolist() == [0, 1, 2, 3]
    np.testing.assert_allclose(data["length"], [random_paths.case(n, 3).strip.length for n in range(4)])
    assert set(data["outcome"].values) <= {"critical", "refused"}


def test_a_path_below_the_floor_is_refused() -> None:
    rows = np.array([[0.0, -6.0, 0.0], [1.0, 0.0, 4.0], [2.0, 2.0, -1.0]])
    row = random_paths.outcome(random_paths.Case("corners", StripModel(12.0, 0.05), rows), 2.0)
    assert row["outcome"] == "refused"
    assert "the floor" in row["message"]
    assert "/" not in row["message"].replace("m^-2", "")
