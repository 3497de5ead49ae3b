"""The study of other choices of the model: each way of finding a critical point against an independent one."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve

from stripfold import elastica
from stripfold.follow.static import StripModel
from studies import variants
from studies.variants import Scene

Z = 3.0


def test_a_pin_that_gives_is_a_longer_strip_that_stretches() -> None:
    """What lies stretches by h^2 / 12 times its length and the force: a spring."""
    h, more = 0.05, 320.0
    scenes = [Scene(StripModel(n, h, kind="rod"), Z, 0.5) for n in (14.0, 14.0 + more)]
    short, long = (variants.end_along_x(scene)[0] for scene in scenes)
    rigid, giving = (variants.giving_along_x(scenes[0], c)[0] for c in (0.0, more * h**2 / 12.0))
    assert rigid == pytest.approx(elastica.critical(Z).advance, abs=1e-9)
    assert giving - rigid == pytest.approx(long - short, rel=0.03)


def test_a_pin_that_slides() -> None:
    """Strictly before the critical state, with the force asked for; with nearly its force at it."""
    last = elastica.critical(Z).state
    scene = Scene(StripModel(14.0, 0.05, kind="rod"), Z, 1.0)
    lam, snap = variants.sliding_along_x(scene, 0.999 * last.force_x)
    assert snap
    assert lam == pytest.approx(last.advance, abs=1e-6)
    assert variants.sliding_along_x(scene, 0.1)[0] < lam


def test_a_clamp_at_the_hinges_angle_has_the_hinges_branch_and_is_stable_on_it() -> None:
    scene, last = Scene(StripModel(14.0, 0.02, kind="rod"), 8.0, 1.0), elastica.critical(8.0).state
    angle = -float(last.theta[-1])
    clamped, snap = variants.clamped_along_x(scene, angle)
    assert snap
    # High up the strip hangs straight below the gripper: hinge or clamp, nearly the same.
    hinge, _ = variants.end_along_x(scene)
    assert hinge < clamped < hinge + 0.01


def test_a_clamp_that_lays_the_sag_down() -> None:
    """lambda at the touch against an initial-value problem from the lift-off: height, angle and touch as conditions."""

    def shot(force_x: float, force_0: float, length: float) -> Any:
        def rate(s: float, y: np.ndarray) -> list[float]:
            _, _, theta, k = y
            return [np.cos(theta), np.sin(theta), k, force_x * np.sin(theta) - (force_0 + s) * np.cos(theta)]

        return solve_ivp(rate, (0.0, length), [0.0] * 4, rtol=1e-9, atol=1e-11, dense_output=True)

    def conditions(p: np.ndarray) -> list[float]:
        found = shot(*p)
        low = brentq(lambda s: np.sin(found.sol(s)[2]), 2.0, 0.8 * p[2])
        return [found.y[1, -1] - Z, found.y[2, -1] - np.radians(45.0), found.sol(low)[1]]

    p = fsolve(conditions, [0.25, -4.0, 7.3])
    lam, snap = variants.clamped_along_x(Scene(StripModel(14.0, 0.02, kind="rod"), Z, 1.0), np.radians(-45.0))
    assert snap is False
    assert lam == pytest.approx(p[2] - shot(*p).y[0, -1], abs=4e-3)  # as far as the hinge's lambda_c: h^2


def test_touch_with_a_pin_that_does_not_give_is_that_of_the_path() -> None:
    scene = Scene(StripModel(14.0, 0.0594, kind="rod"), Z, 2.0)
    fixed = variants.touch_on_path(scene)
    assert variants.giving_on_path(scene, 0.0) == pytest.approx(fixed, abs=1e-9)
    assert abs(variants.giving_on_path(scene, 0.1) - fixed) < 0.02


def test_cases_can_be_sent_to_other_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[bytes] = []

    def pooled(_: object, cases: list[object], *__: object) -> list[object]:
        sent.extend(pickle.dumps(case) for case in cases)
        raise KeyboardInterrupt

    monkeypatch.setattr(variants, "pooled", pooled)
    with pytest.raises(KeyboardInterrupt):
        variants.run(Z, 14.0, 0.05, 1.0, [0.3], [4.0], 0.3, [0.0], 0.1, 0.1)
    assert len(sent) == 10


def test_the_table(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(variants, "touch_on_path", lambda scene: 2.0 + scene.strip.nu)
    monkeypatch.setattr(variants, "clamped_on_path", lambda scene: 1.5)
    monkeypatch.setattr(variants, "giving_on_path", lambda scene, compliance: 2.01)
    monkeypatch.setattr(variants, "end_along_x", lambda scene: (9.8 + scene.strip.nu, True))
    monkeypatch.setattr(variants, "clamped_along_x", lambda scene, angle: (9.0, False))
    data = variants.run(Z, 14.0, 0.05, 1.0, [0.3], [4.0], 0.3, [0.0], 0.1, 0.1)
    text = variants.markdown(data)
    assert "| Poisson's ratio 0.3 | +0.3000 | +0.3000 |" in text
    assert "| gripper clamps the strip at 0 degrees | -0.8000, no snap: the sag touches | - |" in text
    assert text.count("\n") == 2 + 7
