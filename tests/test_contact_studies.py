"""The studies of the moving contact: order and run time, paths below the touch limit, counted constants."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import configuration
from plots import order as figure
from stripfold.analysis.prediction import ElasticaPrediction
from stripfold.analysis.static import StripModel
from stripfold.errors import SolveError
from studies import branches, constants, low_paths, order


def test_order_of_lambda_c_and_its_figure() -> None:
    data = order.run(12.0, 0.0594, 3.0, 2.0, [1, 2, 4, 8], 4)
    np.testing.assert_allclose(data["size"][:, :-1] / data["size"].values[:, 1:], 2.0, rtol=1e-3)
    assert data["elements"].values[:, -1].tolist() == (8 * data["elements"].values[:, 0]).tolist()
    assert 3.5 < float(data["order"].sel(model="rod")) < 4.5
    by_hand = np.abs(data["lambda_c"] - data["lambda_c"].sel(parts=4)).sel(parts=[1, 2])
    np.testing.assert_array_equal(data["error"].sel(parts=[1, 2]), by_hand)
    assert np.isnan(data["error"].sel(parts=[4, 8])).all()
    top, bottom = figure.draw(data).axes
    np.testing.assert_array_equal(top.get_lines()[0].get_ydata(), data["error"].sel(model="rod"))
    np.testing.assert_array_equal(bottom.get_lines()[1].get_xdata(), data["elements"].sel(model="solid"))


def test_a_low_path_is_followed_to_the_interval() -> None:
    """Through the touch, the point contact and the interval; lambda at the touch is the elastica's."""
    outcome, lam = low_paths.landed(StripModel(12.0, 0.02, kind="rod"), 1.2, 1.0)
    assert outcome == low_paths.STABLE
    assert lam == pytest.approx(ElasticaPrediction.at(1.2).last.advance, abs=5e-3)


def test_a_snap_and_a_failure_are_no_agreement(monkeypatch: pytest.MonkeyPatch) -> None:
    assert low_paths.landed(StripModel(12.0, 0.02, kind="rod"), 2.0, 1.0)[0] == low_paths.LIMITED
    with pytest.raises(SolveError, match="too short"):
        low_paths.landed(StripModel(7.0, 0.02, kind="rod"), 3.0, 1.0)

    def landed(strip: StripModel, *_: float) -> tuple[str, float]:
        if strip.kind == "rod":
            raise SolveError("planted")
        return low_paths.STABLE, 8.0

    monkeypatch.setattr(low_paths, "landed", landed)
    data = low_paths.run(2, 7, 1e-3)
    assert data["solid"].values.tolist() == [low_paths.STABLE] * 2
    assert data["rod"].values.tolist() == [low_paths.FAILED] * 2
    assert "planted" in str(data["message"].values[0])


def branch(*points: tuple[float, float]) -> tuple[Any, ...]:
    """Points of a branch from lambda and its rate, made up."""
    places = (SimpleNamespace(lam=lam, tangent=SimpleNamespace(lam=rate)) for lam, rate in points)
    return tuple(SimpleNamespace(point=point) for point in places)


def test_a_maximum_that_the_finer_mesh_lacks_is_spurious(monkeypatch: pytest.MonkeyPatch) -> None:
    finer = branch((8.0, 0.9), (9.8, 0.1), (9.8, -0.1), (9.7, -0.5))
    twice = branch((8.0, 0.9), (9.0, -0.1), (8.9, 0.2), (9.8, 0.1), (9.799, -0.2))
    assert branches.maxima(twice).tolist() == [9.0, 9.8]
    strip, runs = StripModel(12.0, 0.05), []

    def one(points: tuple[Any, ...]) -> Any:
        return lambda *_: runs.append(points) or SimpleNamespace(points=points)

    def spurious(points: tuple[Any, ...], near: tuple[Any, ...], whole: tuple[Any, ...]) -> int:
        monkeypatch.setattr(branches, "from_near_the_end", one(near))
        monkeypatch.setattr(branches, "solve_height", one(whole))
        return branches.spurious(SimpleNamespace(points=points), strip, 3.0, 0.5)  # type: ignore[arg-type]

    assert spurious(finer, finer, twice) == 0
    # Compared near the end first; the whole branch is followed where that is not enough.
    assert runs == [finer]
    assert spurious(twice, finer, twice) == 0
    assert spurious(twice, finer, finer) == 1
    assert spurious(finer, branch((8.0, 0.9), (9.0, -0.1)), branch((8.0, 0.9), (9.0, -0.1))) == 1


def test_constants_are_counted(tmp_path: Path) -> None:
    code = "A = 1\nB: float = -2.0\nC, D = 1, (2, x)\nE = Options(3.0)\nTEXT = 'a'\nON = True\nx = 4\ndef f(): G = 1\n"
    assert [name for name, *_ in constants.constants(code)] == ["A", "B", "C", "D", "E"]
    shared = 'A = 1\nB = 2\n"""Both.\n\nMore."""\nC = 3\ndef f(): ...\n'
    assert [reason for *_, reason in constants.constants(shared)] == ["Both.", "Both.", ""]
    (tmp_path / "solve").mkdir()
    (tmp_path / "solve" / "newton.py").write_text("TOLERANCE = 1e-8\n", encoding="utf-8")
    (tmp_path / "solver.py").write_text("N = 3\n", encoding="utf-8")
    assert list(constants.of_packages(tmp_path, ["solve"])) == [("solve.newton", "TOLERANCE", "1e-08", "")]
    data = constants.run(["solve"], 121)
    assert constants.markdown(data).count("\n") == 2 + data.sizes["constant"]
    assert data.sizes["constant"] > 3
    assert data.attrs["before"] == 121


def test_each_constant_says_what_it_is_for() -> None:
    config = configuration.load(constants.SOURCE.parents[1] / "workflow/config/paper.yaml")
    packages = config["studies"]["solver_constants"]["packages"]
    silent = [where[:2] for where in constants.of_packages(constants.SOURCE, packages) if not where[-1]]
    assert not silent
