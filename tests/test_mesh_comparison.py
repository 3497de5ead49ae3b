"""What another mesh makes of a verdict, and rest states whose contact waves by less than an element."""

from __future__ import annotations

from dataclasses import replace
from math import isnan

import numpy as np
import pytest

from assessing import assess_path
from stripfold.ask.assess import Marks, mesh_change
from stripfold.base.material import Material
from stripfold.follow import contact_set
from stripfold.follow.fall import assess_strip
from stripfold.follow.statics import StripModel
from stripfold.paths.geometric import triangular
from stripfold.paths.low_path import low
from stripfold.strip.contact_mesh import INTERVAL, LYING, Topology

MATERIAL = Material(3780.0)
UNIT = MATERIAL.gravity_length
LENGTH = 12.0
NAN = float("nan")


def test_the_same_events() -> None:
    changes, touch, said = mesh_change(Marks((1.0, 3.0), 2.0), Marks((1.25, 2.5), 2.125))
    assert (changes, touch, said) == ((0.25, -0.5), 0.125, "")


@pytest.mark.parametrize(
    ("here", "there", "said"),
    [
        (Marks((1.0,), NAN), Marks((), NAN), "no critical points, not 1"),
        (Marks((), NAN), Marks((1.0,), NAN), "1 critical point, not 0"),
        (Marks((), 2.0), Marks((), NAN), "does not touch"),
        (Marks((), NAN), Marks((), 2.0), "touches"),
        (Marks((1.0,), NAN), "it could not be", "it could not be"),
        # What a failure hides is no difference.
        (Marks((1.0, 2.0), NAN), Marks((1.0,), 2.0, failed=True), ""),
        (Marks((1.0,), NAN, failed=True), Marks((1.0, 2.0), NAN), ""),
        (Marks((1.0,), NAN, failed=True), Marks((), NAN), "no critical points, not 1"),
    ],
)
def test_other_events_are_said(here: Marks, there: Marks | str, said: str) -> None:
    changes, touch, told = mesh_change(here, there)
    assert told.endswith(said)
    assert bool(told) == bool(said)
    assert len(changes) == len(here.travelled)
    assert isnan(touch)


def test_a_critical_point_on_both_meshes() -> None:
    """Truth: the whole path followed on that mesh from the flat strip, whose elements are planned at other places."""
    path = triangular(LENGTH)
    found = assess_path(MATERIAL, LENGTH * UNIT, path, model="rod")
    strip = StripModel(LENGTH, MATERIAL.relative_thickness, MATERIAL.nu, kind="rod")
    here, there = (assess_strip(strip, path, refinement=r).events[0].travelled for r in (1.0, 1.5))
    (event,) = found.critical
    assert 1.0 / 3.0 < event["change"] / (UNIT * (there - here)) < 3.0
    assert abs(event["change"]) < 1e-4
    assert found.mesh_dependence == ""


def test_a_stable_path_on_both_meshes() -> None:
    found = assess_path(MATERIAL, LENGTH * UNIT, low(LENGTH, 1.0), model="rod")
    assert found.stable
    assert found.mesh_dependence == ""
    assert 0.0 < abs(found.touch_change) < 5e-3 * UNIT


def test_the_size_of_a_fall_is_not_that_of_the_mesh() -> None:
    """Truth: another mesh."""
    path = triangular(18.0)
    runs = [assess_path(MATERIAL, 18.0 * UNIT, path, fall=True, model="rod", refinement=r) for r in (1.0, 1.5)]
    (event,), (other,) = (found.critical for found in runs)
    assert event["drop"] == pytest.approx(other["drop"], rel=0.03)
    assert event["energy"] == pytest.approx(other["energy"], rel=0.1)


@pytest.mark.parametrize(("height", "kind"), [(1.0, INTERVAL), (3.0, LYING)])
def test_a_strip_on_nodes_that_waves_behind_its_lift_off(height: float, kind: Topology) -> None:
    """Truth: the state itself.  Nodes behind its lift-off count as free, as on a coarse mesh after a fall."""
    strip = StripModel(LENGTH, 0.05, kind="rod")
    at = assess_strip(strip, low(LENGTH, height), refinement=1.0).segments[0]
    states = [state for state in at.states if lies(*state) == (2 if kind == INTERVAL else 1)]
    mesh = strip.contact_mesh()
    truth = contact_set.from_nodes(mesh, *states[len(states) // 2])
    assert truth.topology == kind
    problem, point = contact_set.on_nodes(truth)
    columns = contact_set.lying_parts(problem.model, point, contact_set.SAME_PART)[-1]
    behind = problem.model.s[columns] - problem.model.s[columns[0]]
    waving = problem.model.middle[columns[(behind > 0.05) & (behind < 0.8)], 1]
    state = replace(point.state, active=np.setdiff1d(point.active, waving))
    waves = replace(point, state=state)
    assert lies(problem, waves) == lies(problem, point) + 1
    found = contact_set.from_nodes(mesh, problem, waves)
    assert found.topology == kind
    assert found.contact == pytest.approx(truth.contact, abs=0.02)


def lies(problem: object, point: object) -> int:
    return len(contact_set.lying_parts(problem.model, point, contact_set.SAME_PART))  # type: ignore[attr-defined]
