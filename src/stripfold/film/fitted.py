"""Constants fitted on pictures and recordings with a known truth, each with what it was fitted on.

Those of lambda and of the clocks come from synthetic recordings of the design of the study ``recordings_accuracy``, on
other seeds than the one that it reports; those of eta_b in pictures from drawn strips, as of the study
``eta_pictures``, on another seed, too.  No real film has confirmed them.
"""

from __future__ import annotations

LEVEL_SD = 0.035
"""Standard deviation of the onset's level, as a share of its height: at the peak the layers hide each other."""
WINDOW_SHIFT, WINDOW_SD = 0.12, 0.27
"""By how much the onset of a slow snap is measured too late, and the standard deviation of that, in
:attr:`.Speed.delay`: 0 if the speed rises exponentially, 0.25 if it rises steadily, in the mean of films in between."""
FRAME_SHIFT, FRAME_SD = 0.45, 0.137
"""By how much the onset is measured too early, since the snap ends between two frames, and the standard deviation of
that, in the usual distance of the frames."""
GAP_SHIFT, GAP_SD = 0.17, 0.06
"""The same for the longest distance of the frames in the snap, as shares of what it exceeds the usual one by."""

SLOPE_SHARE = BEND_SHARE = 0.25
"""Standard deviations of the slope and of the bend of x's error along the gripper's way, at its ends, as shares of that
of the shift: in recordings with known offsets of the clocks they are 0.21 and 0.26."""
LAG_SD = 0.035
"""Standard deviation of the distance by which a moving marker is shown behind its place where a film is compressed by
prediction from frame to frame, pixels: changes too small for the encoder's quantiser are left out."""
MARKER_REPEATED = 0.25
"""Motion in a frame, relative to that in the frames around it, below which the frame repeats the one before: of 6000
that did not, five moved by less; of 160 repeated ones, coded anew after those before, none by more."""

DEPTH_SD = 0.25
"""Standard deviation of the depth at which a strip is seen in a film, in widths."""
FRICTION_SD = 0.008
"""Standard deviation of a fitted M_0 by what else delays a strip, rho_a g L*^2: stretch, air, inertia."""
USUAL_MISFIT, MAX_MISFIT = 0.006, 0.03
"""Standard deviation of most of the residuals of a strip's shapes, L*: of usual recordings, and from which there is no
eta_b; the worst of them are below it."""
PULL_SD = {"flat_end": 0.082, "offset": 0.015}
"""Standard deviation of what the shapes of a strip say of them, L*, by what else the picture of a wide strip is: of 41
films of both generators, seed 771."""

EDGE_SD = 0.09
"""Standard deviation of a shift of a fold's middle common to all sections, pixels: light differs between its sides.  It
makes the intervals of drawn folds hold 95 % of the truths."""
THICKNESS_SD = 1.0, 0.3
"""Uncertainty of a fold's thickness by the band's width: blur widens it, cloth gives way where it lies on itself;
pixels, and as a share."""
WIDTH_SD = 7.0
"""Standard deviation of a band's width on each section, pixels: wrinkles are in many of them."""
TILT_ERROR = {"fold": 0.008, "cantilever": 0.025, "heart": 0.015, "pear": 0.02}
"""Largest relative error of eta_b by a degree of the camera's tilt, in 95 % of drawn strips up to 2.5 L* wide; of a
hanging strip the far edge of the free end is seen beyond the near one.  Of loops those up to 1.5 L*."""
FACE_SD = {"fold": 0.14, "cantilever": 0.5, "heart": 0.3, "pear": 0.3}
"""Standard deviation of eta_b's error, as a share, over that of a strip's depth (:class:`.shape.Depth`), where it is in
the fit: by wrinkles, hairs, and where the two edges hide each other; of 640 photographs of the study, and of loops
those of :data:`WAVES_SD`."""
LAW_SD = 1.0
"""The same of the logarithm of n in ``M ~ curvature^n``: of 70 photographs of linear strips, seed 31."""
WAVES, WAVES_SD = 5.0, 5e-4
"""Number of waves along a loop that hangs which pass for another shape, and their standard deviation over half of its
length: wrinkles, and where the two edges hide each other; of 117 photographs of loops, seeds 42 and 43."""
