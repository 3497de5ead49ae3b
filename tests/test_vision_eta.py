"""eta_b from pictures, against strips drawn from the heavy elastica and against a law solved by other means."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.integrate import solve_bvp

import drawn_strips as drawn
import stripfold as sf
from stripfold import elastica
from stripfold.base.errors import InvalidInputError, TrackingError
from stripfold.cli import main
from stripfold.film import cantilever, eta

SCALE = 3e-4
SIZE = (640, 520)
SPAN = 480.0
"""Length of the hanging strips, pixels."""


def hanging(length: float, right: bool = True) -> drawn.Array:
    """A cantilever of ``length`` L*, ``SPAN`` pixels long; its clamp is the first point."""
    profile = elastica.cantilever(length).at(np.linspace(0.0, length, 800))
    side = 1.0 if right else -1.0
    unit = SPAN / length
    return np.column_stack([(70.0 if right else 570.0) + side * unit * profile.x, 50.0 - unit * profile.z])


def true_eta(unit: float) -> float:
    """eta_b of a strip whose L* is ``unit`` pixels."""
    return 1.0 / (9.81 * (unit * SCALE) ** 3)


@cache
def share(kind: str, size: float, right: bool = True) -> drawn.Array:
    curve = {"hanging": hanging, "folded": drawn.folded}[kind](size, right)
    return drawn.coverage(curve, 6.0, SIZE)


@pytest.mark.parametrize("length", [0.8, 2.0, 4.0, 7.0])
def test_exact_shapes(length: float) -> None:
    """The collocation's cantilever, whose clamp the fit does not know."""
    profile = elastica.cantilever(length).at(np.linspace(0.0, length, 100))
    points = 100.0 * np.column_stack([profile.x, -profile.z])
    for linear in (True, False):
        fit = cantilever.fit(points, np.full(100, 0.1), 1.0, linear=linear)
        # Chords of the polygon are shorter than the arcs by 1e-5 at most.
        # The longer it hangs, the less its shape says of a second number.
        assert (100.0 / fit.unit) ** 3 == pytest.approx(1.0, rel=5e-4 if linear else 0.03 if length > 5.0 else 5e-3)
        assert fit.exponent == pytest.approx(1.0, abs=5e-3 if length < 5.0 else 0.02)
        assert fit.rms < 1e-3 * 100.0 * length
    part = cantilever.fit(points[35:], np.full(65, 0.1), 1.0)
    assert (100.0 / part.unit) ** 3 == pytest.approx(1.0, rel=2e-3)


@cache
def saturating(exponent: float = 0.5, load: float = 12.0) -> drawn.Array:
    """A cantilever of length 1 with M = kappa^n under ``load``, solved as a boundary value problem."""

    def rates(s: drawn.Array, y: drawn.Array) -> drawn.Array:
        angle, moment = y[0], y[1]
        bend = np.sign(moment) * np.abs(moment) ** (1.0 / exponent)
        return np.array([bend, -load * (1.0 - s) * np.cos(angle), np.cos(angle), np.sin(angle)])

    s = np.linspace(0.0, 1.0, 100)
    guess = np.array([0.8 * s, 1.0 - s, s, 0.3 * s])
    for scale in (0.05, 0.2, 0.5, 1.0):
        full, load = load, load * scale
        found = solve_bvp(rates, lambda a, b: np.array([a[0], b[1], a[2], a[3]]), s, guess, tol=1e-8, max_nodes=50000)
        load, guess = full, found.sol(s)
    assert found.success
    return np.asarray(found.sol(s)[2:].T)


def test_nonlinear_law_is_detected() -> None:
    points = SPAN * saturating(0.5, 1.5)
    fit = cantilever.fit(points, np.full(100, 0.1), 1.0, linear=False)
    assert fit.exponent == pytest.approx(0.5, abs=0.01)
    straight = cantilever.fit(points, np.full(100, 0.1), 1.0)
    assert straight.rms > 20.0 * fit.rms
    curve = points + np.array([60.0, 40.0])
    found = eta.from_image(drawn.picture(drawn.coverage(curve, 6.0, SIZE)), SCALE, "cantilever")
    assert found.linear is False
    n, low, high = found.exponent
    assert low < 0.5 < high
    assert n == pytest.approx(0.5, abs=0.01)
    # The secant at the largest curvature: M / kappa = kappa^(n - 1) = M_0^((n - 1) / n).
    moment = float(np.trapezoid(1.5 * (saturating(0.5, 1.5)[:, 0]), dx=1.0 / 99.0))
    expected = 1.5 / moment ** ((0.5 - 1.0) / 0.5) / 9.81 / (SPAN * SCALE) ** 3
    assert found.secant(1.0) == pytest.approx(expected, rel=0.1)


def test_slope_at_the_clamp() -> None:
    """Given, it decides where the law is not linear: that of the secant at the clamp; a linear strip has its own."""
    straight = drawn.picture(share("hanging", 2.0))
    free = eta.from_image(straight, SCALE, "cantilever")
    assert np.degrees(free.fit.slope) == pytest.approx(0.0, abs=0.5)
    held = eta.from_image(straight, SCALE, "cantilever", slope=0.0)
    assert held.eta_b == pytest.approx(true_eta(SPAN / 2.0), rel=0.02)
    assert held.interval[0] < true_eta(SPAN / 2.0) < held.interval[1]
    soft = drawn.picture(drawn.coverage(SPAN * saturating(0.5, 3.0) + np.array([60.0, 40.0]), 6.0, SIZE))
    fits = [eta.from_image(soft, SCALE, "cantilever", slope=slope) for slope in (None, 0.0, 5.0)]
    assert fits[0].eta_b < fits[2].eta_b < fits[1].eta_b
    slopes = [np.degrees(fit.fit.slope) for fit in fits]
    assert slopes == pytest.approx([slopes[0], 0.0, 5.0], abs=0.1)
    assert slopes[0] > 5.0
    with pytest.raises(TrackingError, match="with a slope of 60 degrees"):
        eta.from_image(straight, SCALE, "cantilever", slope=60.0)


VIEWS = np.random.default_rng(5).uniform([-3.0, -3.0, 0.0, 0.4], [3.0, 3.0, 0.05, 2.0], (4, 4))
"""Tilt and turn of a camera, degrees, the strip's width over its distance, and the width, L*."""


@pytest.mark.parametrize(("kind", "method", "size"), [("folded", "fold", 100.0), ("hanging", "cantilever", 2.0)])
def test_interval_holds_from_where_the_camera_may_stand(kind: str, method: str, size: float) -> None:
    """The near edge is in scale; what is behind it makes eta_b up to 7.5 % too high."""
    curve, unit = (drawn.folded(size), size) if kind == "folded" else (hanging(size), SPAN / size)
    truth, off = true_eta(unit), []
    for tilt, turn, depth, width in VIEWS:
        how = {"width": width * unit, "distance": width * unit / depth, "tilt": tilt, "turn": turn}
        image = drawn.picture(drawn.photographed(curve, 6.0, SIZE, **how), 1, slope=0.0)
        found = eta.from_image(image, SCALE, method)
        assert found.interval[0] < truth < found.interval[1]
        off.append(found.eta_b / truth - 1.0)
    assert max(off) > 0.03
    stated = eta.from_image(image, SCALE, method, view=eta.View(tilt=1.0, roll=0.2, depth=0.01))
    assert np.ptp(stated.interval) < 0.85 * np.ptp(found.interval)


def test_interval_covers() -> None:
    """Interval and scatter belong together: the free end and the plumb line are not random here."""
    truth = true_eta(SPAN / 2.0)
    found = [
        eta.from_image(drawn.picture(share("hanging", 2.0), seed, noise=12.0, blur=1.5), SCALE, "cantilever")
        for seed in range(3)
    ]
    assert all(one.interval[0] < truth < one.interval[1] for one in found)
    assert np.std([one.eta_b for one in found]) < 0.5 * (found[0].interval[1] - found[0].interval[0])


@pytest.mark.parametrize(
    ("unit", "right", "look"),
    [
        (100.0, True, {}),
        (100.0, False, {"noise": 10.0}),
        (60.0, True, {"blur": 2.0}),
        (100.0, True, {"strip": 30.0, "ground": 160.0}),
    ],
)
def test_folded_strip(unit: float, right: bool, look: dict[str, float]) -> None:
    found = eta.from_image(drawn.picture(share("folded", unit, right), 2, **look), SCALE, "fold")
    truth = true_eta(unit)
    assert found.interval[0] < truth < found.interval[1]
    assert found.eta_b == pytest.approx(truth, rel=0.02)
    assert found.fit.height == pytest.approx(elastica.folded_loop(6.0 / unit).height * unit, abs=0.5)
    assert found.fit.width == pytest.approx(6.0, abs=1.5)


@pytest.mark.parametrize(
    ("curve", "method", "message"),
    [
        (hanging(2.0), "fold", "no loop"),
        (drawn.folded(100.0), "cantilever", "a closed outline"),
        (hanging(2.0) + np.array([0.0, 230.0]), "cantilever", "lower end is cut"),
        (drawn.folded(100.0) + np.array([-360.0, 0.0]), "fold", "no loop inside"),
        (drawn.folded(100.0) + np.array([0.0, 188.0]), "fold", "border cuts"),
        (np.column_stack([np.linspace(60, 560, 300), np.linspace(60, 62, 300)]), "fold", "no loop"),
        (hanging(0.55), "cantilever", "bent by 0.3% of its length"),
    ],
)
def test_picture_without_the_strip_is_refused(curve: drawn.Array, method: str, message: str) -> None:
    with pytest.raises(TrackingError, match=message):
        eta.from_image(drawn.picture(drawn.coverage(curve, 6.0, SIZE)), SCALE, method, "it.png")


def test_bad_scale_and_method(photo: dict[str, str]) -> None:
    for scale, method, words in (
        (0.3, "fold", "scale = 0.3 .*: 0.3 mm are 0.0003"),
        (float("nan"), "fold", "scale = nan"),
        (1e-6, "fold", "eta_b 0.1"),
        (1e-4, "x", "method"),
    ):
        with pytest.raises(InvalidInputError, match=words):
            sf.eta_b(image=photo["folded"], scale=scale, method=method)


@pytest.fixture
def photo(tmp_path: Path) -> dict[str, str]:
    paths = {}
    for kind, size in (("folded", 100.0), ("hanging", 2.0)):
        paths[kind] = str(tmp_path / f"{kind}.png")
        Image.fromarray(drawn.picture(share(kind, size))).save(paths[kind])
    return paths


@pytest.mark.parametrize(
    ("more", "code", "words"),
    [
        (["--scale", "1e-4"], 2, "method is missing"),
        (["--method", "fold"], 2, "scale is missing"),
        (["--scale", "1e-4", "--method", "cantilever"], 4, "folded.png: a closed outline"),
        (["--scale", "1e-4", "--method", "fold", "--picture", "out.jpg"], 2, "ends in .png"),
    ],
)
def test_command_line_refuses(
    photo: dict[str, str], capsys: pytest.CaptureFixture[str], more: list[str], code: int, words: str
) -> None:
    assert main(["eta", "--image", photo["folded"], *more]) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("stripfold: error: ")
    assert words in err
    assert err.count("\n") == 1


def test_eta_b_of_bending_tests(capsys: pytest.CaptureFixture[str]) -> None:
    """Units by hand: 1 gf = 9.80665e-3 N; L* = (rigidity / weight)^(1/3) is Peirce's bending length."""
    assert sf.eta_b(bending_length=0.03).gravity_length == pytest.approx(0.03)
    weight, rigidity = 0.13 * 9.81, 0.05 * 9.80665e-3 * 1e-4 / 1e-2
    expected = (rigidity / weight) ** (1.0 / 3.0)
    by_rigidity = sf.eta_b(rigidity=rigidity, gsm=130.0)
    kawabata = sf.eta_b(kes_b=0.05, kes_2hb=0.04, gsm=130.0)
    for found in (by_rigidity, kawabata):
        assert found.gravity_length == pytest.approx(expected)
        assert found.eta_b == pytest.approx(0.13 / rigidity)
    assert kawabata.friction_moment_star == pytest.approx(0.02 * 9.80665e-3 / (weight * expected**2))
    assert kawabata.friction_moment == pytest.approx(0.02 * 9.80665e-3)
    assert np.isnan(by_rigidity.friction_moment)
    assert main(["eta", "--gsm", "130", "--kes-b", "0.05", "--kes-2hb", "0.04"]) == 0
    assert "0.0001961 N" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, "one of fold_height"),
        ({"bending_length": 0.03, "fold_height": 0.02}, "one of fold_height"),
        ({"rigidity": 1e-5}, "gsm is missing"),
        ({"bending_length": 0.03, "gsm": 100.0}, "with rigidity or kes_b"),
        ({"rigidity": 1e-5, "gsm": 100.0, "kes_2hb": 0.1}, "kes_2hb"),
        ({"bending_length": 2.5}, "from 0.002 to 0.3 m; the unit is m"),
        ({"rigidity": 1e-5, "gsm": -1.0}, "gsm"),
        ({"rigidity": 1e-5, "gsm": 0.2}, "from 2 to 10000 g m.-2; the unit is g m.-2: 0.2 kg m.-2 are 200"),
    ],
)
def test_bad_bending_tests(given: dict[str, float], words: str) -> None:
    with pytest.raises(InvalidInputError, match=words):
        sf.eta_b(**given)
