"""The explorer: states for its tables, its page, and what a browser shows of it."""

from __future__ import annotations

from shutil import which

import numpy as np
import pytest
import xarray as xr

from conftest import ROOT
from stripfold import elastica
from stripfold.paths.rpath import Part, PlannedState
from studies import explorer as study
from tasks import explorer as page
from tasks.explorer_states import NODES, contact_states, free_states, lifted_states, nodes_and_integral

STORED = ROOT / "results" / "studies" / "explorer.nc"


def end(lengths, angles):
    """Where a part ends, from its length and angles."""
    _, integral = nodes_and_integral()
    return lengths * (np.cos(angles) @ integral[-1]), lengths * (np.sin(angles) @ integral[-1])


@pytest.mark.parametrize("z", [0.5, 3.0])
def test_free_states_are_those_of_the_elastica(z):
    row = free_states(z, 13)
    x, height = end(row.lengths[:, 0], row.angles[:, 0])
    np.testing.assert_allclose(height, z, atol=1e-6)
    np.testing.assert_allclose(row.lengths[:, 0] - x, row.advance, atol=1e-6)
    assert np.all(np.diff(row.advance) > 0.0)
    critical = elastica.critical(z).state
    assert row.advance[-1] == pytest.approx(critical.advance, abs=1e-9)
    some = elastica.state_at_advance(z, float(row.advance[-4]))
    assert row.lengths[-4, 0] == pytest.approx(some.length, abs=1e-4)


def test_states_in_contact_go_from_the_touch_to_the_fold():
    z = 1.0
    row, loop = contact_states(z, 9), elastica.folded_loop()
    assert row.advance[0] == pytest.approx(elastica.critical(z).state.advance, abs=1e-6)
    assert row.lengths[-1, 0] == pytest.approx(loop.arc, abs=1e-6)
    # The rest hangs without horizontal force, mirrored.
    lifted = elastica.state_no_horizontal_force(z)
    assert row.lengths[-1, 1] == pytest.approx(lifted.length, abs=1e-6)
    assert row.advance[-1] == pytest.approx(loop.arc + lifted.length + loop.offset + lifted.gripper[0], abs=1e-6)
    landed_x, landed_z = end(row.lengths[:, 0], row.angles[:, 0])
    x, height = end(row.lengths[:, 1], row.angles[:, 1])
    np.testing.assert_allclose(landed_z, 0.0, atol=1e-6)
    np.testing.assert_allclose(height, z, atol=1e-6)
    np.testing.assert_allclose(row.lengths.sum(axis=1) - landed_x - x, row.advance, atol=1e-6)


def test_lifted_states_know_their_heights():
    heights, lengths, angles = lifted_states(4.0)
    np.testing.assert_allclose(end(lengths, angles)[1], heights, atol=1e-8)
    assert angles.shape == (len(heights), NODES)


def test_a_strip_drawn_beside_the_truth_is_noticed():
    state = elastica.state_at_advance(3.0, 8.0)
    truth = PlannedState.of(20.0, Part(state, state.length - 10.0, -1.0))
    drawn = truth.at(np.linspace(0.0, 20.0, 300))
    assert study.distance(truth, drawn) < 1e-3
    assert study.distance(truth, drawn + np.array([0.0, 0.01])) == pytest.approx(0.01, abs=1e-3)


@pytest.mark.skipif(not STORED.is_file(), reason="the study has not been run")
def test_the_page_is_one_file_of_its_own():
    with xr.open_dataset(STORED) as tables:
        text = page.of_tables(tables.load())
    assert len(text.encode()) < 3_000_000
    for missing in ("/* tables */", "/* strip.js */", "/* page.js */", "/* page.css */", "src=", "href="):
        assert missing not in text


@pytest.mark.slow
@pytest.mark.skipif(which("chromium") is None, reason="no Chromium")
@pytest.mark.skipif(not STORED.is_file(), reason="the study has not been run")
def test_the_page_in_a_browser():
    with xr.open_dataset(STORED) as stored:
        tables = stored.load()
    place = study.draw_places(15.0, np.random.default_rng(3), 1)
    answers = study.drive(tables, 15.0, [one.way for one in place])
    for one, drawn in zip(place, answers["drawn"], strict=True):
        assert study.distance(one.state, np.array(drawn)) < 2e-3
    assert answers["warns"]
    # Gone back, the strip that fell lies until the sag comes off, and falls again at lambda_c only: touches, fell, off.
    lies, off = [True, True, False], [False, False, True]
    assert answers["loop"] == [lies, off, off, lies]
    assert answers["paper"] == ["free", "fell", "came off"]
    assert "taut" in answers["stopped"]
    assert "lowest height" in answers["lowest"]
    assert answers["refusal"]
    picture, controls = answers["phone"]
    assert picture > controls
