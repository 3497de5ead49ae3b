"""Numbers of pictures and recordings; see :mod:`.table`."""

from __future__ import annotations

from studies.summary import facts_recordings
from studies.summary.number import Number, Source

# A table: one formatted argument per line would take five times the space.
# fmt: off
RECORDINGS = (
    Source("calibration", facts_recordings.calibration, (
        Number("calibration_rms", "rms", "pixel", 3, "< 0.25 pixel, no view over 3 times the median",
            "reprojection error of the public chessboard set, all {views} views, the worst {worst:.1f} times the "
            "median", lambda f: f.worst <= 3.0),
    )),
    Source("calibration", lambda d: {"rms": d.charuco_rms, "corners": int(d.charuco_corners)}, (
        Number("charuco_rms", "rms", "pixel", 3, "< 0.25 pixel",
            "reprojection error of the public ChArUco picture with its published camera, {corners} corners"),
    )),
    Source("centrelines", facts_recordings.centrelines, (
        Number("centreline_rms", "rms", "mm", 3, "< 0.25 mm",
            "rms distance of the centreline in the photograph of a textile from its authors' midline"),
        Number("centreline_span", "span", "mm", 4, ">= 222 mm", "horizontal extent of that centreline"),
    )),
    Source("strip_looks", facts_recordings.strip_looks, (
        Number("strip_looks", "measured", "count", 4, "all of 24 or more",
            "strips measured, of {cases} looks ({seed}): 10, 40 and 80 mm wide, light, dark and two colours as bright "
            "as the table, plain and striped, on plain and textured tables, in either direction; {outside} outside of "
            "their 95 % intervals, at most {worst:.2f} mm off",
            lambda f: f.measured == f.cases >= 24),
    )),
    Source("camera_bump", facts_recordings.camera_bump, (
        Number("camera_bump", "share", "1", 3, "= 1, of 30 or more",
            "share of {cases} moves of the camera by 3 to 10 pixels ({seed}) that are noticed, {before} between its "
            "calibration and the film, the others in the film; {chain} of the second generator",
            lambda f: f.noticed == f.cases >= 30),
    )),
    Source("markerless", facts_recordings.markerless, (
        Number("markerless_coverage", "share", "1", 3, ">= 0.85, of 18 measured or more",
            "share of the 95 % intervals of lambda that contain the truth, {measured} measured of {cases} recordings "
            "without a marker and without a robot's log, by a template ({seed}); root mean square error {rms:.2f} mm, "
            "median half width {half:.2f} mm", lambda f: f.share >= 0.85 and f.measured >= 18),
    )),
    Source("eta_pictures", facts_recordings.eta_pictures, (
        Number("eta_fold_coverage", "share", "1", 3, "0.93 to 0.97, of 400 folds or more",
            "share of the 95 % intervals of eta_b that contain the truth, {cases} drawn folds ({seed}), the {refused} "
            "refused among them; median error {error:.2%}, half width {half:.2%}",
            lambda f: 0.93 <= f.share <= 0.97 and f.cases >= 400),
        Number("eta_not_fabric", "given", "count", 4, "= 0, of 30 or more",
            "eta_b given for pictures that show no strip, by either method, of {empty} ({seed})",
            lambda f: f.given == 0 and f.empty >= 30),
    )),
    Source("recordings_accuracy", facts_recordings.recordings_accuracy, (
        Number("recordings", "cases", "count", 4, ">= 200", "synthetic recordings of the design ({seed})"),
        Number("lambda_coverage", "share", "1", 3, "0.93 to 0.97, of 200 recordings or more",
            "share of the 95 % intervals of lambda that contain the truth, {measured} measured of {cases} synthetic "
            "recordings ({seed}); {refused} refused and {unseen} without a snap have no interval and do not count; by "
            "generator, with the root mean square error: {generators}; binomial standard deviation of such a share "
            "{share_error:.3f}",
            lambda f: 0.93 <= f.share <= 0.97 and f.cases >= 200),
        Number("lambda_coverage_50", "half", "1", 3, "0.48 to 0.52, of 200 recordings or more",
            "share of the 50 % intervals of lambda that contain the truth, {measured} measured ({seed}); binomial "
            "standard deviation of such a share {half_error:.3f}",
            lambda f: 0.48 <= f.half <= 0.52 and f.cases >= 200),
        Number("clock_coverage", "clock_share", "1", 3, "0.93 to 0.97, of 200 recordings or more",
            "share of the 95 % intervals of the offset between robot log and video that contain the truth, "
            "of {clocks} ({seed}); 50 % intervals {clock_half:.3f}; median error {clock_median:.1f} ms, "
            "root mean square {clock_rms:.1f} ms",
            lambda f: 0.93 <= f.clock_share <= 0.97 and f.cases >= 200),
        Number("lambda_rms_clean", "sound_rms", "mm", 2, "< 0.15 mm",
            "root mean square error of lambda in the {sound} measured recordings that are filmed as docs/measuring.md "
            "asks for ({seed}); largest {sound_worst:.2f} mm"),
        Number("lambda_bias", "median", "mm", 2, "absolute value < 0.1 mm",
            "median error of lambda at the onset in the {measured} measured recordings; mean {mean:.2f} mm",
            lambda f: abs(f.median) < 0.1),
        Number("lambda_sd", "sd", "mm", 2, "no criterion",
            "standard deviation of that error, from its median absolute deviation; root mean square {rms:.2f} mm"),
        Number("recordings_failed", "refused_share", "1", 3, "<= 0.03",
            "share of the {cases} synthetic recordings that end in an error; in {unseen} more no snap is seen"),
        Number("recordings_flagged", "warned", "1", 3, "<= 0.15",
            "share with a warning of the {sound} measured recordings that are filmed as docs/measuring.md asks for "
            "({seed})"),
        Number("recordings_wrong", "wrong", "count", 4, "= 0",
            "measured lambda more than 1 mm off and outside its 95 % interval, without a warning, of {measured} "
            "({seed})"),
        Number("camera_false_alarms", "camera_moved", "count", 4, "= 0, of 60 or more",
            "recordings of the {cases}, none of whose cameras moves, that are said to be of one that does",
            lambda f: f.camera_moved == 0 and f.cases >= 60),
        Number("eta_motion_error", "eta", "1", 2, "<= 0.03, of 30 recordings or more",
            "median relative error of eta_b by the strip's motion before the snap, its friction described to 10 % and "
            "its eta_b wrongly, {eta_measured} of {eta_cases} synthetic recordings with a slow gripper from 0.7 L* "
            "before the limit on ({seed}); largest {eta_worst:.2%}; of {chain_eta_measured} of {chain_eta_cases} of "
            "the second generator, which begin nearer to it, {chain_eta:.2%} and {chain_eta_worst:.2%}",
            lambda f: f.eta <= 0.03 and f.eta_measured >= 30),
        Number("eta_motion_error_fitted", "fitted_eta", "1", 2, "<= 0.03, of 30 recordings or more",
            "the same with no friction described, M_0 fitted beside eta_b, by the median {excess:.3f} rho_a g L*^2 too "
            "large; largest {fitted_eta_worst:.2%}; second generator {chain_fitted_eta:.2%} and "
            "{chain_fitted_eta_worst:.2%}",
            lambda f: f.fitted_eta <= 0.03 and f.fitted_eta_measured >= 30),
        Number("eta_motion_coverage", "eta_share", "1", 3, ">= 0.9, of 30 recordings or more",
            "share of the 95 % intervals of that eta_b that contain the truth, median half width {eta_half:.2%}; with "
            "the friction fitted {fitted_eta_share:.2f} and {fitted_eta_half:.2%}; second generator "
            "{chain_eta_share:.2f} and {chain_fitted_eta_share:.2f}",
            lambda f: min(f.eta_share, f.fitted_eta_share) >= 0.9 and f.eta_measured >= 30),
        Number("recordings_wrong_all", "wrong_all", "count", 4, "no criterion",
            "measured lambda more than 1 mm off and outside its 95 % interval, with a warning or without, of "
            "{measured} ({seed})"),
    )),
    Source("recordings", facts_recordings.recordings, (
        Number("recordings_measured", "measured", "count", 4, ">= 40",
            "recordings, of {all} of the configured materials, in which a snap was measured"),
        Number("measured_above_model", "above", "1", 3, "> 0.9",
            "verification of the measuring chain: share of the {measured} snaps, filmed synthetically with friction in "
            "the strips, that are measured above the frictionless lambda_c; extrapolated to zero speed {zero:.2f}; "
            "recordings without a snap do not count"),
    )),
    Source("video_benchmark", facts_recordings.video_benchmark, (
        Number("tracking_rate", "rate", "1/s", 3, ">= 150",
            "frames of 1280 x 720 (h264) over the processor time of the whole command `stripfold measure`, report "
            "included: film of {many} frames, median of {d.sizes[run]} runs; with one in four of them {short:.0f}"),
        Number("tracking_memory", "memory", "1", 3, "<= 1.15",
            "peak memory of the measuring process with {many} frames over that with {frames}"),
        Number("measure_seconds", "seconds", "s", 2, "<= 6",
            "a recording of the workflow rendered ({render:.1f} s) and measured with its report ({measure:.1f} s); its "
            "motion, a solution in time, takes {motion:.1f} s and does not count"),
    )),
)
# fmt: on
