"""The studies of the moving contact: order and run time, paths below the touch limit, counted constants."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_bvp

import configuration
from plots import low_paths as low_figure
from plots import order as figure
from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.follow.static import StripModel
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


def test_outcomes_of_low_paths(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stable, a snap above the touch limit, one of a strip that is pushed together; a failure is no outcome."""
    thick = StripModel(20.0, 0.15, kind="rod")
    assert [low_paths.followed(thick, z, 1.0)[0] == low_paths.LIMITED for z in (0.3, 1.6)] == [True, True]
    outcome, found = low_paths.followed(StripModel(14.0, 0.02, kind="rod"), 0.6, 1.0)
    assert outcome == low_paths.STABLE
    assert found["hold"] * 0.6**2 == pytest.approx(2.74, rel=0.02)
    truth = elastica.critical(0.6).state
    assert truth.sag is not None
    # From where it lands to where it lies in the end, which is as far from the edge as from the gripped end.
    upper = truth.length - truth.sag.s
    landed = truth.advance - 7.0 + float(truth.x[-1] - truth.at(truth.sag.s).x)
    assert found["slide"] == pytest.approx(7.0 - upper - landed, abs=0.02)

    def fails(strip: StripModel, *_: float) -> Any:
        if strip.kind == "solid":
            raise SolveError("planted")
        return low_paths.STABLE, dict.fromkeys(low_paths.NUMBERS, 1.0)

    monkeypatch.setattr(low_paths, "followed", fails)
    first, second = (low_paths.case((0, (14.0, 0.6, 0.06), on_solid)) for on_solid in (True, False))
    assert [first[mesh] for mesh in low_paths.MESHES] == [low_paths.STABLE, low_paths.FAILED, low_paths.FAILED]
    assert "planted" in first["message"]
    assert [second[mesh] for mesh in low_paths.MESHES] == [low_paths.STABLE, low_paths.OMITTED, low_paths.OMITTED]


def test_limits_of_low_paths() -> None:
    """With little weight the push falls by 1 / (0.348 z^3) per advance; at the touch limit nothing may give."""
    borne, push = low_paths.of_curve(0.25)
    assert borne / 0.25**3 == pytest.approx(0.348, rel=5e-3)
    assert push * 0.25**2 == pytest.approx(2.752, rel=1e-3)
    assert abs(low_paths.of_curve(elastica.touch_limit() - 1e-6)[0]) < 1e-3
    # A rod that gives as much as the elastica bears, at either of its limits.
    for height, sign in ((1.3, 1.0), (0.55, -1.0)):
        h = float(np.sqrt(12.0 * low_paths.of_curve(height)[0] / (45.0 + low_paths.FREE)))
        strip = StripModel(45.0, h, kind="rod")
        assert low_paths.followed(strip, height + 0.08 * sign, 1.0)[0] == low_paths.LIMITED
        assert low_paths.followed(strip, height - 0.02 * sign, 1.0)[0] == low_paths.STABLE


def test_a_bump_that_grows() -> None:
    """On the heavy elastica: half a bump, from its lift-off without curvature to its top, where nothing hangs on it."""
    push = 11.0
    half = 4.4934 / np.sqrt(push)

    def rates(t: Array, y: Array, p: Array) -> Array:
        curvature = -push * np.sin(y[2]) - p[0] * (t - 1.0) * np.cos(y[2])
        return p[0] * np.stack([np.cos(y[2]), np.sin(y[2]), y[3], curvature])

    def ends(lift_off: Array, top: Array, _: Array) -> Array:
        return np.append(lift_off, top[2])

    t = np.linspace(0.0, 1.0, 51)
    high = low_paths.BUMP / push**2
    rise = np.pi * high / half / 2.0
    guess = [half * t, high * t**2 * (3.0 - 2.0 * t), rise * np.sin(np.pi * t), rise * np.pi / half * np.cos(np.pi * t)]
    found = solve_bvp(rates, ends, t, np.array(guess), p=[half])
    assert found.success
    assert found.y[1, -1] == pytest.approx(high, rel=1e-2)


def test_a_low_path_in_time() -> None:
    """Friction takes energy and the fold is the accurate one."""
    found = low_paths.in_time(((0.4, 1.2), 0.8), 8.0, 0.06, 0.0)
    assert found["dissipated"] > 0.01
    assert found["error"] < 0.03
    assert found["kinetic"] > 0.5 * 0.8**2


def test_low_paths_and_their_figure(monkeypatch: pytest.MonkeyPatch) -> None:
    def in_time(at: tuple[tuple[float, float], float], **_: float) -> dict[str, float]:
        (mu, _height), speed = at
        return {**dict.fromkeys(low_paths.TIME_NUMBERS, mu), "kinetic": speed**2}

    monkeypatch.setattr(low_paths, "CURVE", np.array([0.3, 0.6, 0.9, 1.3, 1.5]))
    monkeypatch.setattr(low_paths, "in_time", in_time)
    monkeypatch.setattr(low_paths, "followed", lambda *_: (low_paths.STABLE, dict.fromkeys(low_paths.NUMBERS, 1.0)))
    data = low_paths.run(6, 2, 7, 14.0, 0.06, [0.6, 1.2], [0.0, 0.4], 0.02, 0.2)
    # The first on the solid are those that the elastica says are stable, whichever cases these are.
    inside, on_solid = low_paths.inside(data), data["solid"].values != low_paths.OMITTED
    assert not inside.all()
    assert np.flatnonzero(on_solid).tolist() == np.flatnonzero(inside)[:2].tolist() != [0, 1]
    assert data["time_error"].values.tolist() == [[0.0, 0.0], [0.4, 0.4]]
    assert float(data["slow_kinetic"]) == pytest.approx(0.01)
    assert 1e-3 < float(data["snap_energy"]) < 1e-2
    assert low_paths.markdown(data).count("\n") == 6
    limits, _ = low_figure.draw(data).axes
    drawn = [line for line in limits.get_lines() if line.get_label() in {"_stable", "_limit point"}]
    assert [np.size(line.get_xdata()) for line in drawn] == [6, 0]


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
    data = constants.run(["solve"], 121, ["solve.newton"])
    assert 0 < data.attrs["later"] == int((data["module"] == "solve.newton").sum()) < data.sizes["constant"]
    assert constants.markdown(data).count("\n") == 2 + data.sizes["constant"]
    assert data.sizes["constant"] > 3
    assert data.attrs["before"] == 121


def test_each_constant_says_what_it_is_for() -> None:
    config = configuration.load(constants.SOURCE.parents[1] / "workflow/config/paper.yaml")
    packages = config["studies"]["solver_constants"]["packages"]
    silent = [where[:2] for where in constants.of_packages(constants.SOURCE, packages) if not where[-1]]
    assert not silent
