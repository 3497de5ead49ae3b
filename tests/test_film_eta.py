"""eta_b from a picture, a bending test or the motion of a strip, against shapes that are known."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_bvp

import drawn_strips as drawn
import stripfold as sf
from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.base.errors import MeasurementError, TrackingError
from stripfold.base.material import GRAVITY, Material
from stripfold.cli import main
from stripfold.elastica import with_friction
from stripfold.elastica.branch import state_at_advance
from stripfold.film import (
    cantilever,
    eta,
    eta_motion,
)
from stripfold.film.camera import Camera, Mapping
from stripfold.film.eta_motion import MotionEtaB
from stripfold.film.recording import Entries, Recording
from stripfold.follow.statics import StripModel
from stripfold.follow.time import static_limit

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


LOOP = 3.0
"""Half of the length of the loops, L*."""


@cache
def looped(kind: str, turned: float = 0.0) -> drawn.Array:
    return drawn.looped(kind, LOOP, 110.0, turned)


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
    assert found.fit.linear is False
    n, low, high = found.fit.law
    assert low < 0.5 < high
    assert n == pytest.approx(0.5, abs=0.01)
    # The secant at the largest curvature: M / kappa = kappa^(n - 1) = M_0^((n - 1) / n).
    moment = float(np.trapezoid(1.5 * (saturating(0.5, 1.5)[:, 0]), dx=1.0 / 99.0))
    expected = 1.5 / moment ** ((0.5 - 1.0) / 0.5) / 9.81 / (SPAN * SCALE) ** 3
    assert found.fit.secant(1.0, SCALE) == pytest.approx(expected, rel=0.1)


@pytest.mark.slow
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


@pytest.mark.parametrize(
    ("kind", "method", "size"),
    [
        ("folded", "fold", 100.0),
        pytest.param("hanging", "cantilever", 2.0, marks=pytest.mark.slow),
        ("heart", "heart", 110.0),
        pytest.param("pear", "pear", 110.0, marks=pytest.mark.slow),
    ],
)
def test_interval_holds_from_where_the_camera_may_stand(kind: str, method: str, size: float) -> None:
    """The near edge is in scale; what is behind it makes eta_b up to 7.5 % too high."""
    shapes = {"folded": drawn.folded, "hanging": hanging}
    curve = shapes[kind](size) if kind in shapes else looped(kind)
    unit = SPAN / size if kind == "hanging" else size
    truth, off = true_eta(unit), []
    for tilt, turn, depth, width in VIEWS:
        # Of a loop one side shows its face: a wide one is refused.
        width = 0.5 * width if method == kind else width
        how = {"width": width * unit, "distance": width * unit / depth, "tilt": tilt, "turn": turn}
        image = drawn.picture(drawn.photographed(curve, 6.0, SIZE, **how), 1, slope=0.0)
        found = eta.from_image(image, SCALE, method)
        assert found.interval[0] < truth < found.interval[1]
        off.append(found.eta_b / truth - 1.0)
    assert max(off) > 0.03
    stated = eta.from_image(image, SCALE, method, view=eta.View(tilt=1.0, roll=0.2, depth=0.01))
    # The shape of a pear leaves more open than the camera does.
    assert np.ptp(stated.interval) < (1.0 if kind == "pear" else 0.85) * np.ptp(found.interval)


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
    ("kind", "turned", "look"),
    [("heart", 0.0, {}), ("heart", -6.0, {"strip": 30.0, "ground": 170.0}), ("pear", 5.0, {"noise": 8.0, "blur": 1.8})],
)
def test_hanging_loops(kind: str, turned: float, look: dict[str, float]) -> None:
    """Hearts and pears are told from each other, and neither where they are held nor their length has to be known."""
    image = drawn.picture(drawn.coverage(looped(kind, turned), 6.0, SIZE), 2, **look)
    found = eta.from_image(image, SCALE, "loop")
    assert found.fit.method == kind
    assert found.interval[0] < true_eta(110.0) < found.interval[1]
    assert found.eta_b == pytest.approx(true_eta(110.0), rel=0.03)
    assert found.fit.length == pytest.approx(2.0 * LOOP * 110.0, rel=0.01)
    assert [name for name, _ in found.rows()][-3:] == ["loop", "length", "height"]
    with pytest.raises(TrackingError):
        eta.from_image(image, SCALE, "fold")


ROUND = np.linspace(0.0, 2.0 * np.pi, 800)
EDGE = np.column_stack([np.linspace(60.0, 460.0, 800), np.linspace(115.0, 119.0, 800)])


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
        (hanging(2.0), "loop", "encloses no loop"),
        (drawn.folded(100.0), "loop", "no loop of a hanging strip"),
        (np.column_stack([320.0 + 90.0 * np.cos(ROUND), 250.0 + 110.0 * np.sin(ROUND)]), "loop", "strip"),
        (looped("heart") + np.array([0.0, 200.0]), "heart", "border|encloses no loop"),
        # A straight edge, bent at its end by more than that.
        (
            EDGE + np.array([[0.0, 5.0]]) * np.clip(1.0 - (EDGE[:, :1] - 60.0) / 40.0, 0.0, None) ** 2,
            "cantilever",
            r"would be 0\.4\d L\* long",
        ),
    ],
)
def test_picture_without_the_strip_is_refused(curve: drawn.Array, method: str, message: str) -> None:
    with pytest.raises(TrackingError, match=message):
        eta.from_image(drawn.picture(drawn.coverage(curve, 6.0, SIZE)), SCALE, method, "it.png")


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


ETA_B, LENGTH, FLAT_END = 3780.0, 0.45, -0.2


UNIT = Material(ETA_B).gravity_length


HEIGHT = 3.4 * UNIT


WIDTH = 0.03


@pytest.mark.parametrize("share", [0.5, 0.97])
def test_without_friction_shapes_are_those_of_the_elastica(share: float):
    """Between the heights of the stored branches."""
    z = 3.3
    advance = share * elastica.critical(z).advance
    state = state_at_advance(z, advance)
    distance = np.linspace(0.0, state.length, 50)
    at = state.at(state.length - distance)
    found = with_friction.branch(z).shapes(0.0, np.array([advance]), distance)[0]
    np.testing.assert_allclose(found, np.column_stack([state.length - at.x, at.z]), atol=1e-3)


def test_with_friction_shapes_are_those_of_the_rod():
    """Finite elements with the hysteresis itself, thin and hardly extensible: the friction shifts it by 0.19 L*."""
    z, moment, length = 4.0, 0.04, 24.0
    held = static_limit(StripModel(length, 0.005, kind="rod"), z, moment, 1.5)
    problem, point = held.states[-10]
    model = problem.model
    curve = model.mid_surface(point.q) + np.array([0.5 * length, 0.0])
    found, without = (with_friction.branch(z).shapes(m, curve[:1, 0], model.s)[0] for m in (moment, 0.0))
    np.testing.assert_allclose(found, curve, atol=8e-3)
    assert np.abs(without - curve).max() > 0.15
    assert held.lam == pytest.approx(elastica.critical(z).advance + elastica.friction_delay(z) * moment, abs=0.03)


def pinhole(depth: float, places: Array) -> Array:
    """Pixels of places, shape (n, 2), m, this far behind the folding plane: the camera looks 5 degrees down."""
    focal, tilt = 900.0, np.radians(5.0)
    x, z = places[:, 0] - 0.02, places[:, 1] - 0.15
    ahead = (0.8 + depth) * np.cos(tilt) - z * np.sin(tilt)
    up = z * np.cos(tilt) + (0.8 + depth) * np.sin(tilt)
    return np.column_stack([240.0 + focal * x / ahead, 180.0 - focal * up / ahead])


def mapping() -> Mapping:
    """Of that camera: the homography of four corners, no lens distortion."""
    corners = np.array([[-0.1, 0.0], [0.2, 0.0], [0.2, 0.15], [-0.1, 0.15]])
    matrix = np.array([[900.0, 0.0, 240.0], [0.0, 900.0, 180.0], [0.0, 0.0, 1.0]])
    rows = []
    for (u, v), (x, z) in zip(pinhole(0.0, corners), corners, strict=True):
        rows += [[u, v, 1, 0, 0, 0, -x * u, -x * v, -x], [0, 0, 0, u, v, 1, -z * u, -z * v, -z]]
    return Mapping(Camera(matrix, np.zeros(5), (480, 360)), np.linalg.svd(np.array(rows))[2][-1].reshape(3, 3))


def seen(depth: float, count: int = 40, noise: float = 1e-4) -> SimpleNamespace:
    """Tracks of a strip without friction up to 0.35 L* before its snap, seen this far behind the folding plane."""
    last = elastica.critical(3.4).advance - 0.35
    advance = np.linspace(last - 1.0, last, count) * UNIT
    stations = np.linspace(0.0, 0.97 * LENGTH, 40)
    curves = []
    for a in advance:
        state = state_at_advance(3.4, a / UNIT)
        lifted = stations < state.length * UNIT
        at = state.at(state.length - stations[lifted] / UNIT)
        curve = np.column_stack([stations, np.zeros(40)])
        curve[lifted] = UNIT * np.column_stack([state.length - at.x, at.z])
        curves.append(mapping().to_robot(pinhole(depth, curve + np.array([FLAT_END, 0.0]))))
    t = 0.5 + np.linspace(0.0, 10.0, count)
    return SimpleNamespace(
        seen=np.ones(count, bool),
        grip_time=t,
        strip_time=t,
        gripped_end=np.column_stack([FLAT_END + advance, np.full(count, HEIGHT)]),
        points=np.array(curves) + np.random.default_rng(0).normal(0.0, noise, (count, 40, 2)),
        stations=stations,
    )


def described(**strip: Any) -> Recording:
    board = {"type": "chessboard", "columns": 9, "rows": 6, "square": 0.025}
    marker = {"dictionary": "4x4_50", "id": 7, "size": 0.024, "offset": [0.0, -0.03]}
    entries = {
        "title": "made up",
        "strip": {"length": LENGTH, "eta_b": 2500.0, "width": WIDTH, **strip},
        "gripper": {"height": HEIGHT, "speed": 0.003, "flat_end": FLAT_END, "marker": marker},
        "video": "video.mkv",
        "camera": {"images": "camera", "board": board},
        "plane": {"image": "plane.png", "board": board},
        "robot": {"grid": "robot.csv"},
    }
    return Recording(Path(), Entries.of(entries))


def measured(
    tracks: Any, off: float = 0.0, by_hand: tuple[float, float] = (0.0, 0.0), **strip: Any
) -> MotionEtaB | MeasurementError:
    """With a flat end that is ``off`` in the description; ``by_hand``: standard deviations of it and of the offset."""
    asked, event = described(**strip), elastica.critical(3.4).advance * UNIT - off
    gripper = asked.entries.gripper.model_copy(update={"flat_end": FLAT_END + off})
    asked = Recording(asked.folder, asked.entries.model_copy(update={"gripper": gripper}))
    return eta_motion.measure(asked, mapping(), tracks, event, event, True, (*by_hand, 1e-4))


@pytest.mark.parametrize("depth", [0.0, 0.5 * WIDTH, WIDTH])
def test_eta_b_and_depth_from_made_up_tracks(depth: float):
    """The described eta_b, which is two thirds of the true one, has no part in it."""
    known = measured(seen(depth), friction_moment=0.0, rho_a=0.2)
    assert isinstance(known, MotionEtaB)
    assert known.eta_b == pytest.approx(ETA_B, rel=4e-3)
    assert known.depth == pytest.approx(depth, abs=1e-3)
    assert known.low < ETA_B < known.high
    assert known.friction < 1e-3


def test_friction_is_fitted_unless_it_is_described():
    """Described friction lowers the eta_b that shapes without any have, by more than twice its M_0."""
    tracks = seen(0.5 * WIDTH)
    fitted = measured(tracks)
    assert isinstance(fitted, MotionEtaB)
    assert not fitted.known
    assert fitted.friction < 5e-3
    assert fitted.low < ETA_B < fitted.high
    wrong = measured(tracks, friction_moment=0.02 * 0.2 * GRAVITY * UNIT**2, rho_a=0.2)
    assert isinstance(wrong, MotionEtaB)
    assert wrong.friction == pytest.approx(0.02, rel=0.1)
    assert 1.04 < wrong.eta_b / ETA_B < 1.08
    assert wrong.high - wrong.low < 0.6 * (fitted.high - fitted.low)


def test_no_number_where_there_is_none():
    tracks = seen(0.0)
    few = SimpleNamespace(**{**vars(tracks), "seen": np.arange(40) < 4})
    assert "3 frames" in str(measured(few))
    bent = SimpleNamespace(**{**vars(tracks), "points": tracks.points * [1.0, 1.4]})
    other = measured(bent, friction_moment=0.0, rho_a=0.2)
    assert isinstance(other, MeasurementError)
    assert "off those of a strip with one eta_b" in str(other)
    numbers = eta_motion.numbers(other)
    assert numbers.pop("misfit") > 0.03 * UNIT
    assert all(np.isnan(value) for value in numbers.values())


@pytest.mark.parametrize("off", [-0.015, 0.01, 0.015])
def test_a_wrong_flat_end_is_refused_with_what_the_shapes_say(off: float):
    """0.01 is more than three deviations of a flat end given to 2 mm and of what the shapes say."""
    with pytest.raises(eta_motion.ContradictionError, match=r"gripper\.flat_end = ") as refused:
        measured(seen(0.5 * WIDTH), off, (1e-3, 1e-3))
    assert f"{FLAT_END + off:g} m, by the strip's shapes it is" in str(refused.value)
    said = float(re.search(r"it is (-?[\d.]+) m", str(refused.value))[1])  # type: ignore[index]
    assert said == pytest.approx(FLAT_END, abs=0.003)
    assert "flat_end_uncertainty" in str(refused.value)


def test_a_wrong_offset_is_refused_where_there_is_no_log():
    """A marker's offset that is wrong moves the gripped end, not the strip."""
    tracks = seen(0.5 * WIDTH)
    for off in (-0.005, 0.005):
        moved = SimpleNamespace(**{**vars(tracks), "gripped_end": tracks.gripped_end + np.array([off, 0.0])})
        asked, event = described(), elastica.critical(3.4).advance * UNIT + off
        with pytest.raises(eta_motion.ContradictionError, match=r"marker\.offset = .*by the strip's shapes it is"):
            eta_motion.measure(asked, mapping(), moved, event, event, True, (1e-3, 1e-3, 1e-4))


def test_a_described_eta_b_is_contradicted_beyond_three_deviations_of_both():
    """By hand: each interval's 95 % half width is 1.96 standard deviations of the logarithm."""
    found = measured(seen(0.5 * WIDTH), friction_moment=0.0, rho_a=0.2)
    assert isinstance(found, MotionEtaB)
    own, given = np.log(found.high / found.low) / 3.92, 0.1
    for deviations, said in ((2.7, False), (3.3, True), (-2.7, False), (-3.3, True)):
        eta_b = found.eta_b * np.exp(deviations * np.hypot(own, given))
        interval = eta_b * np.exp([-1.96 * given, 1.96 * given])
        strip = described(eta_b=eta_b, eta_b_interval=interval.tolist()).entries.strip
        assert bool(found.contradicts(strip)) is said


def test_pulls_of_right_numbers_are_small():
    found = measured(seen(0.5 * WIDTH), 0.0, (1e-3, 1e-3))
    assert isinstance(found, MotionEtaB)
    assert [pull.name for pull in found.pulls] == ["flat_end", "offset"]
    assert all(abs(pull.deviations) < 1.0 for pull in found.pulls)
    assert abs(eta_motion.numbers(found)["flat_end_off"]) < 2e-3
