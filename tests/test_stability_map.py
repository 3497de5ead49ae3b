"""The stability map: boundaries and margins against states found one by one, friction, bad input, the study."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import stripfold as sf
from stripfold import elastica
from stripfold.ask.friction import friction_boundary
from stripfold.ask.map import GripperMap, gripper_map
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import Material
from stripfold.cli import main
from stripfold.elastica.half_fold import critical_state_fixed_lift_off
from stripfold.files import store
from stripfold.follow.statics import StripModel, solve_height

LENGTH = 12.0
STRIP = ["map", "--length", "0.3", "--eta-b", "3780"]


@pytest.fixture(scope="module")
def found() -> GripperMap:
    return gripper_map(LENGTH)


def test_boundaries_against_states_found_alone(found: GripperMap) -> None:
    for z in (0.1, 0.5, 1.2, 1.58, 1.59, 1.9, 2.345, 4.2, 6.5, 8.0):
        alone = elastica.critical(z)
        boundary = found.snap if alone.snap else found.touch
        assert float(boundary.at(z)) == pytest.approx(alone.state.advance, abs=5e-7)
    for z in (1.7, 3.0, 7.0):  # where landed strips come off
        both = elastica.bistable_range(z)
        assert both is not None
        assert float(found.touch.at(z)) == pytest.approx(both.landing.advance, abs=5e-7)


def test_ends_of_the_boundaries(found: GripperMap) -> None:
    """Truth: the touch limit, the folded loop, and the state of the whole strip's length that becomes unstable."""
    assert found.snap.z[0] == pytest.approx(elastica.touch_limit(), abs=1e-9)
    assert found.touch.advance[0] == pytest.approx(7.168090, abs=1e-6)
    last = critical_state_fixed_lift_off(LENGTH)
    assert (found.snap.advance[-1], found.snap.z[-1]) == pytest.approx((last.advance, last.gripper[1]), abs=1e-7)
    assert tuple(found.lifted[-1]) == pytest.approx((last.advance, last.gripper[1]), abs=1e-7)
    # The lifted strip's line meets the boundary as a tangent, as an R-path does.
    way = found.lifted[-1] - found.lifted[-2]
    slope = float(found.snap.slope_at(found.snap.z[-1:])[0])
    assert way[0] / way[1] == pytest.approx(slope, abs=0.1)
    # The landed one ends with the gripper behind the held end by all that is not in the loop.
    assert np.linalg.norm(np.diff(found.lifted_landed, axis=0), axis=1).max() < 0.5
    assert tuple(found.lifted_landed[-1]) == pytest.approx((2.0 * LENGTH - 4.683470 + 2.484620, 0.0), abs=1e-5)


def test_where_a_strip_hangs_and_lies(found: GripperMap) -> None:
    for z in (0.8, 3.0, 6.0):
        least, largest = found.hanging(np.array(z))
        inside = elastica.state_at_advance(z, float(largest) - 1e-5)
        assert inside.clearance > 0.0
        assert inside.length < LENGTH
        if z < elastica.touch_limit():
            assert elastica.state_at_advance(z, float(largest) + 1e-5).clearance < 0.0
        else:
            with pytest.raises(InvalidInputError, match="at most"):
                elastica.state_at_advance(z, float(largest) + 1e-5)
        places = np.array([least - 0.01, least + 0.01, largest - 1e-5, largest + 1e-5])
        assert found.hangs(places, np.full(4, z)).tolist() == [False, True, True, False]
        # Above the touch limit a strip can do both.
        assert bool(found.lies(largest - 1e-5, np.array(z))) is (z > elastica.touch_limit())
        assert found.lies(largest + 0.1, np.array(z))
    assert np.isnan(found.hanging(np.array(LENGTH))).all()


def test_margin_against_many_critical_points(found: GripperMap) -> None:
    heights = np.linspace(elastica.touch_limit(), found.snap.z[-1], 60)
    boundary = np.array([(elastica.critical(z).state.advance, z) for z in heights])
    places = np.array([(9.0, 3.0), (8.0, 1.0), (5.0, 5.0), (1.0, 0.5), (11.0, 5.0), (10.0, 4.999)])
    exact = found.margin(*places.T)
    near = np.linalg.norm(places[:, None] - boundary, axis=-1).min(axis=1)
    assert np.all(exact <= near + 1e-9)
    assert exact == pytest.approx(near, abs=0.01)
    # Twice as dense samples change nothing: Newton's method has found the foot of the perpendicular.
    foot = float(found.snap.slope_at(np.array([3.0]))[0])
    off = np.array([float(found.snap.at(3.0)), 3.0]) + 0.25 * np.array([-1.0, foot]) / np.hypot(1.0, foot)
    assert float(found.margin(off[0], off[1])) == pytest.approx(0.25, abs=1e-9)
    assert np.isnan(found.margin(np.array(12.0), np.array(3.0)))


def test_barrier_against_pairs_of_states(found: GripperMap) -> None:
    both = elastica.bistable_range(3.3)
    assert both is not None
    for distance in (1e-4, 2e-3, both.width - 1e-6):
        advance = both.critical.advance - distance
        assert float(found.barrier(np.array(advance), np.array(3.3))) == pytest.approx(both.barrier(advance), rel=1e-3)
    outside = np.array([both.landing.advance - 1e-4, both.critical.advance + 1e-4])
    assert np.isnan(found.barrier(outside, np.full(2, 3.3))).all()


def test_eigenvalues_against_a_thin_rod(found: GripperMap) -> None:
    """The rod's are those of other equations, elements and linear algebra."""
    run = solve_height(StripModel(LENGTH, 0.01, kind="rod"), 3.0, 0.5)
    points = [at.point for at in run.points if 1e-3 < run.lam - at.point.lam < 6.0]
    assert len(points) > 5
    # At the same distance from lambda_c, which thickness shifts a little.
    distance = run.lam - np.array([point.lam for point in points])
    ours = found.eigenvalues(float(found.snap.at(3.0)) - distance, 3.0)
    assert ours == pytest.approx([point.eigenvalues[0] for point in points], rel=5e-3)


def test_in_si(tmp_path) -> None:
    in_si = sf.Strip(length=0.3, eta_b=3780, rho_a=0.2).map()
    unit, found = in_si.strip.gravity_length, in_si.in_star
    x, z = np.array([-0.05, 0.15]), np.array([0.05, 0.08])
    assert in_si.margin(x, z) == pytest.approx(unit * found.margin((x + 0.15) / unit, z / unit), nan_ok=True)
    assert in_si.hangs(x, z).tolist() == [True, False]
    assert in_si.lies(0.1, 0.02)
    assert in_si.touch_limit == pytest.approx(1.586171 * unit, rel=1e-6)
    x_snap, z_snap = in_si.snap_boundary[10]
    point = sf.Strip(length=0.3, eta_b=3780).critical(z_snap, model="elastica")
    assert x_snap == pytest.approx(point.x_c, abs=1e-7)
    barrier = in_si.barrier(x_snap - 1e-4 * unit, z_snap)
    law = float(found.coefficient[10]) * 1e-6
    assert barrier == pytest.approx(0.2 * 9.81 * unit**2 * law, rel=1e-3)
    in_si.to_netcdf(tmp_path / "map.nc")
    stored = xr.open_dataset(tmp_path / "map.nc").load()
    hangs = stored["hangs"].values == 1
    places = np.meshgrid(stored["map_x"], stored["map_z"])
    np.testing.assert_allclose(stored["margin"], in_si.margin(*places), rtol=1e-9)
    np.testing.assert_allclose(np.stack([stored["snap_x"], stored["snap_z"]], axis=1), in_si.snap_boundary, rtol=1e-9)
    for name in ("margin", "eigenvalue"):
        np.testing.assert_array_equal(np.isfinite(stored[name].values), hangs)
    assert (stored["eigenvalue"].values[hangs] > 0.0).all()
    assert len(in_si.plot().axes) == 1


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["--length", "0.2"], "length"),
        (["--length", "4.0"], "length"),
        (["--eta-b", "-1"], "eta_b"),
        (["--output", "map.csv"], "output"),
        (["--plot", "none/map.png"], "plot"),
    ],
)
def test_bad_input(options: list[str], word: str, capsys, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    given = dict(zip(STRIP[1::2], STRIP[2::2], strict=True)) | {"--output": "map.nc"}
    given |= dict(zip(options[::2], options[1::2], strict=True))
    assert main(["map", *(text for pair in given.items() for text in pair)]) == 2
    told = capsys.readouterr().err
    assert word in told
    assert told.count("\n") == 1
    assert not list(tmp_path.iterdir())


ETA_B, RHO_A = 3780.0, 0.2
MATERIAL = Material(ETA_B, rho_a=RHO_A)
SHORT = 9.0 * MATERIAL.gravity_length
COMMAND = ["map", "--length", f"{SHORT:.12g}", "--eta-b", f"{ETA_B}", "--rho-a", f"{RHO_A}"]


@pytest.mark.slow
def test_little_friction_delays_by_the_law(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Truth: lambda_c of the elastica and its delay to first order, of which kappa_y takes up to a tenth."""
    star = 0.005
    moment = star * MATERIAL.scales["N"]
    data, picture = tmp_path / "map.nc", tmp_path / "map.png"
    asked = [*COMMAND, f"--friction-moment={moment:.12g}", "--json", "--output", str(data), "--plot", str(picture)]
    assert main(asked) == 0
    said = json.loads(capsys.readouterr().out)
    assert "lifted on the line" in said["friction_history"]
    assert said["units"]["friction_moment"] == "N"
    assert picture.is_file()

    stored = store.read(data)
    assert stored.attrs["friction_moment"] == pytest.approx(moment)
    places = np.stack([stored["friction_x"], stored["friction_z"]], axis=1)
    np.testing.assert_allclose(places, said["friction_boundary"], rtol=1e-9)

    snaps = np.array(said["friction_snap"])
    advance, z = np.array(said["friction_boundary"]).T / MATERIAL.gravity_length + [[4.5], [0.0]]
    assert snaps.any()
    # Friction raises the height from which on a strip snaps.
    assert np.all(z[snaps] > elastica.touch_limit())
    assert np.all(np.diff(snaps.astype(int)) >= 0)
    for height, end in zip(z[snaps], advance[snaps], strict=True):
        delay = end - elastica.critical(height).state.advance
        assert 0.85 < delay / (star * elastica.friction_delay(height)) < 1.02


@pytest.mark.slow
def test_a_long_strip_with_friction_has_an_end_at_each_height() -> None:
    """Where an element is about to slide the strip may be lost: a step there went back along the branch."""
    found = friction_boundary(40.97, 0.0810222932581516)
    assert np.all(np.diff(found.advance) > 0.0)
    assert list(found.snaps) == sorted(found.snaps)
    exact = [elastica.critical(height).state.advance for height in found.z[found.snaps]]
    delay = (found.advance[found.snaps] - exact) / [elastica.friction_delay(height) for height in found.z[found.snaps]]
    assert np.all((delay / 0.0810222932581516 > 0.8) & (delay / 0.0810222932581516 < 1.05))


@pytest.mark.parametrize("moment", ["-1e-3", "0", "0.1", "nan"])
def test_no_such_friction(moment: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*COMMAND, f"--friction-moment={moment}"]) == 2
    told = capsys.readouterr().err
    assert "friction_moment" in told
    assert told.count("\n") == 1
