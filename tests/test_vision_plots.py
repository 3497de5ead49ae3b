"""Figures of pictures and recordings: what is drawn is what the data say."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from stripfold.plots import measured, real_paths
from studies.plots import recordings_accuracy


def recordings() -> xr.Dataset:
    """Two materials, two heights, two speeds; one without a snap."""
    eta, z, v = (a.ravel() for a in np.meshgrid([820.0, 3780.0], [0.1, 0.2], [0.001, 0.002], indexing="ij"))
    model = 3.0 * z
    event = model + 5.0 * v
    fields = {
        "eta_b": eta,
        "height": z,
        "speed": v,
        "lambda_model": model,
        "lambda_event": event,
        "lambda_low": event - 1e-3,
        "lambda_high": event + 1e-3,
        "snapped": np.array([1.0] * 7 + [0.0]),
        "synthetic": np.ones(8),
    }
    data = xr.Dataset({name: ("recording", values) for name, values in fields.items()})
    track = np.stack([event[:, None] + np.linspace(-0.01, 0.0, 5), np.repeat(z[:, None], 5, 1)], axis=2)
    return data.assign(track=(("recording", "sample", "axis"), track))


def test_measured_values_stand_above_the_line():
    ax, above = measured.draw(recordings()).axes
    lines = [line.get_xydata() for line in ax.lines if len(line.get_xydata()) == 2 and line.get_linestyle() == "-"]
    np.testing.assert_allclose(lines[0], [[10.0, 30.0], [20.0, 60.0]])
    dots = np.concatenate([c[0].get_xydata() for c in above.containers])
    assert len(dots) == 7
    np.testing.assert_allclose(np.unique(np.round(dots[:, 1], 6)), [0.5, 1.0])
    assert "synthetic recordings" in {text.txt.get_text() for text in ax.artists}


def test_real_paths_end_where_the_gripper_was():
    axes = real_paths.draw(recordings()).axes
    assert len(axes) == 2
    for ax, snaps in zip(axes, (4, 3), strict=True):
        tracks = [line for line in ax.lines if len(line.get_xdata()) == 5]
        dots = [line for line in ax.lines if len(line.get_xdata()) == 1]
        assert (len(tracks), len(dots)) == (4, snaps)
        assert dots[0].get_xydata()[0] == pytest.approx([30.5, 10.0])
        assert tracks[0].get_xydata()[-1] == pytest.approx([30.5, 10.0])


def test_errors_and_what_share_holds_the_truth():
    sd = np.full(20, 1e-4)
    off = np.linspace(-1.0, 1.0, 20) * 1e-4
    off[3] = 9e-4
    data = xr.Dataset(
        {
            "event": ("case", 0.3 + np.append(off, np.nan)),
            "truth": ("case", np.full(21, 0.3)),
            "sd": ("case", np.append(sd, np.nan)),
            "outcome": ("case", np.array(["measured"] * 20 + ["refused"], dtype=object)),
            "flags": ("case", np.array([""] * 10 + ["too fast"] * 11, dtype=object)),
        }
    )
    top, bottom = recordings_accuracy.draw(data).axes
    assert "95.0 % of 20 hold the truth" in {text.txt.get_text() for text in top.artists}.pop()
    assert sum(patch.get_height() for patch in bottom.patches) == pytest.approx(20 * 1.0)
    recordings_accuracy.draw(data.isel(case=slice(20, None)))
