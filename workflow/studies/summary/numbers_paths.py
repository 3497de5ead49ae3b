"""Numbers of motion in time, of folding paths and of friction; see :mod:`.table`."""

from __future__ import annotations

from studies.summary import facts, facts_claims, facts_delay, facts_fabrics, facts_layers, facts_paths
from studies.summary.number import Number, Source

# A table: one formatted argument per line would take five times the space.
# fmt: off
PATHS = (
    # Motion in time.
    Source("schemes", facts.schemes, (
        Number("dynamics_order", "order", "1", 4, "> 1.9 for both",
            "observed order of the time integrator, the smaller of {oscillator:.3f} on a linear oscillator and "
            "{swing:.3f} on a swing of the strip (steps of {steps} sqrt(L*/g))",
            lambda f: f.oscillator > 1.9 and f.swing > 1.9),
        Number("dynamics_energy_drift", "drift", "1", 2, "< 1e-4",
            "energy error of the undamped fall up to the touch over the potential energy released, scheme without "
            "dissipation, the loss at impacts ({contact:.1%}) allowed for; the default dissipation takes "
            "{numerical:.1%}"),
    )),
    Source("modes", facts.modes, (
        Number("modes_error", "error", "1", 2, "< 0.002",
            "largest relative error of the frequency of the motion, {d.sizes[mode]} modes of a clamped strip of "
            "{d.attrs[length_star]:g} L* without gravity and hanging; {steps} steps per period, "
            "{d.attrs[elements]} elements; (K, M) alone: {linear:.1e}"),
    )),
    Source("lag", facts.lag, (
        Number("lag_exponent{suffix}", "slope", "1", 4, "{theory} within 0.05 or within the interval",
            "exponent of the snap's lag in the gripper's speed, {damping}, {count} speeds from {speeds} sqrt(g L*), 95 "
            "% interval +- {half_width:.3f}; the lags are {ratios} times those of the normal form",
            lambda f: f.apart < max(0.05, f.half_width)),
    )),
    Source("lag", facts.lag_limit, (
        Number("lag_limit_error", "error", "L*", 2, "< 0.001 L*",
            "lambda at the snap, extrapolated to zero speed, less the static lambda_c (in air: {damped:.1e} L*)"),
    )),
    Source("falls", facts.falls, (
        Number("falls", "cases", "count", 4, ">= 6", "falls of the study, each with other settings"),
        Number("falls_failed", "failed", "count", 4, "= 0", "falls, of {cases}, that end without a touch"),
        Number("falls_penetration", "penetration", "L*", 4, "< 1e-4 L*", "deepest penetration of the floor, all falls"),
        Number("falls_energy_gain", "gain", "1", 2, "< 1e-6", "largest energy gained, rho_a g L*^2, all falls"),
        Number("falls_end_state", "spread", "L*", 2, "< 1e-3 L*",
            "largest distance of the end states of {same} from that of the first fall"),
        Number("touch_convergence", "fine", "L*", 2, "< 5e-3 L*, and less than at the halving before",
            "change of the first touch's x when the elements are halved; at the halving before: {coarse:.1e} L*",
            lambda f: f.fine < f.coarse),
        Number("handed_over", "rest", "L*", 2, "< 0.01 L*",
            "largest distance between a state at rest and the equilibrium that the static solver finds from it"),
    )),
    Source("collapse", facts_claims.collapse, (
        Number("collapse_jump", "jump", "L*", 3, "> 0.5 L*, more than ten times as far as the gripper",
            "farthest move of a point of the strip in the fall, in which the gripper moves {moved:.1e} L*",
            lambda f: f.jump > 10.0 * f.moved),
        Number("collapse_stable_after", "stable", "count", 4, "all {after}",
            "static states after the fall without a negative eigenvalue, to the end: {end}",
            lambda f: f.stable == f.after > 1),
    )),
    # Folding paths and internal friction.
    Source("assessment", facts_claims.paths, (
        Number("paths_critical", "critical", "count", 4, "all {runs}",
            "paths with a critical point, of {runs}: triangular, circular and R-path of {materials} materials, without "
            "friction", lambda f: f.critical == f.runs),
        Number("path_boundary_error", "boundary", "L*", 2, "< 1e-3 L*",
            "largest distance of a path's critical point from lambda_c of the x-axis study at its height"),
        Number("rpath_bifurcations", "bifurcations", "count", 4, "all {materials}",
            "materials whose R-path meets the stability boundary at less than 15 degrees (at most {angle_r:.1f})",
            lambda f: f.bifurcations == f.materials),
        Number("snap_angle", "angle", "degree", 3, "> 15 degrees",
            "least angle at which a triangular or circular path meets the stability boundary"),
        Number("fold_error_frictionless", "shape", "L*", 2, "< 0.02 L*",
            "largest distance of the finished fold from the planned one, all {runs} runs"),
        Number("fold_paths_apart", "paths_apart", "L*", 2, "< 1e-3 L*",
            "largest difference of that distance between the three paths of one material"),
        Number("rpath_touch_frictionless", "off", "L*", 3, "> 0.1 L*",
            "least distance of the first touch from the planned one on an R-path without friction; all: {offs}"),
        Number("triangular_touch_scaled", "line", "L*", 2, "< 0.2 L*",
            "spread over all materials of the first touch's distance from the fold line on the triangular path: "
            "{lines} L*, which vanishes with L*"),
        Number("hold_over_weight", "hold", "1", 2, "< 1",
            "largest force at the held end over the weight of what lies in the end, R-path; triangular path "
            "{hold_triangular:.1f}, circular path {hold_circular:.1f}"),
    )),
    Source("friction", facts_claims.friction, (
        Number("rpath_touch_friction", "touch", "L*", 2, "< 0.1 L*",
            "largest distance of the first touch from the planned one with the smallest sufficient friction (pull "
            "{touch_pull:.3f}, hysteresis {touch_moment:.3f})"),
        Number("rpath_deviation", "deviation", "L*", 2, "< 0.5 L*",
            "largest distance of a state from the planned one on R-paths with the smallest sufficient friction (pull "
            "{deviation_pull:.2f}, hysteresis {deviation_moment:.2f})"),
    )),
    Source("printed_law", facts_claims.printed_law, (
        Number("printed_law_stiffness", "stiffness", "1", 2, "< 1e-6",
            "bending stiffness under the printed law of a strip rotated by 90 degrees over that of a level one; under "
            "the objective law {objective:.6f}"),
    )),
    Source("tangency", facts_paths.tangency, (
        Number("tangency_error_max", "error", "L*", 2, "< 1e-3 L* for at least five lengths, none missing",
            "largest distance of the solid's critical point on the R-path from its lambda_c(z), {lengths} L*, "
            "{d.sizes[thickness]} thicknesses, {missing} missing; on the elastica {elastica:.0e} L*",
            lambda f: f.missing == 0 and f.d.sizes["length"] >= 5),
        Number("tangency_angle", "angle", "degree", 2, "less than on the thickest strip",
            "largest angle between R-path and stability boundary at h = {thinnest:g} L*; at h = {thickest:g} L* "
            "{angle_thick:.1f} degrees", lambda f: f.angle < f.angle_thick),
        Number("rpath_plan_error", "plan", "1", 2, "< 1e-8",
            "largest error of the first integral in the planned states of the R-paths"),
    )),
    Source("assessment", facts_paths.assessment, (
        Number("first_touch_{path}", "value", "L*", 3, "{bound} 0 by more than its error, every strip that falls",
            "first touch less the planned one of the R-path, {path} path, the least of the {falls} strips that fall: "
            "{each}, errors at most {errors:.0e} L* (the paper: {side} it; from the fold line: {lines}); strips laid "
            "down without a fall do not count: {laid}", lambda f: f.fallen and f.decided, "error"),
    )),
    Source("friction", facts_paths.friction, (
        Number("rpath_two_ways", "two", "count", 4, ">= 1",
            "materials, of {d.sizes[material]}, whose unstable planned state has two outcomes without friction, on "
            "the lower layer or at rest above it ({two_lengths} L* long; not: {one_lengths})"),
        Number("rpath_completed", "completed", "count", 4, "all {d.sizes[material]}",
            "materials whose whole R-path is followed with friction of either law, the last state within 0.05 L* of "
            "the folded one (farthest: {farthest:.3f} L*)", lambda f: f.completed == f.d.sizes["material"]),
        Number("friction_ratio_max", "ratio", "1", 2, "< 0.1",
            "largest pulling force / gripper force on an R-path followed with the smallest sufficient friction, all "
            "{d.sizes[material]} materials; medians along the path {medians}"),
        Number("friction_moment_max", "moment", "1", 2, "< 0.1",
            "largest sufficient M_0 / rho_a g L*^2 of bending hysteresis, all {d.sizes[material]} materials; the "
            "smallest {least_moment:.1e}"),
    )),
    Source("friction_steps", facts_paths.friction_steps, (
        Number("friction_step_k_f", "k_f", "1", 3, "k_f times the step within a factor 1.2",
            "smallest sufficient k_f, largest over smallest for steps of {steps} L*; k_f times the step is "
            "{products} g", lambda f: f.spread < 1.2),
        Number("friction_step_M_0", "M_0", "1", 3, "< 1.2",
            "smallest sufficient M_0 of bending hysteresis, largest over smallest for the same steps"),
    )),
    Source("friction_delay fabrics", facts_delay.friction_delay, (
        Number("delay_at_fabric_friction", "rise", "L*", 3, "> 0",
            "rise of lambda with the fabrics' median M_0 of {median:.2f} rho_a g L*^2 at z = {height:g} L*, up to the "
            "touch of the sag where nothing snaps; +-{error:.2f} by halved step, elements and kappa_y and by the "
            "history of the lift; with the fabrics' least and most friction {least:.2f} and {most:.2f}; the paper's "
            "text gives no amount"),
        Number("delay_law", "law", "1", 2, "< 0.05",
            "largest relative difference of the rise over M_0 = {smallest:g} from the perturbation of the elastica "
            "({coefficients} L*)"),
        Number("snap_vanishes", "no_snap", "1", 2, "no criterion",
            "M_0 / rho_a g L*^2 from which on the sag is laid down without a snap, largest of all heights "
            "({no_snap_each} L*). No observer sees that boundary: the sag's largest speed over the gripper's, at z = "
            "{height:g} L*, has no jump there ({speeds}); from the fabrics' least of {real_least:.2f} on {snapping} "
            "snaps, and the sag falls at most {speed:.1f} times as fast as the gripper moves"),
        Number("fold_height_friction", "fold", "1", 2, "< 0.1",
            "relative rise of the height of a fold with M_0 = {folded:g}: what friction changes of an L* measured by "
            "it"),
    )),
    Source("friction_touch", facts_delay.friction_touch, (
        Number("friction_touch_{path}", "change", "L*", 2, "no criterion",
            "largest change of the first touch on the {path} path by a fabric's friction (M_0 of 0.3 and more); less "
            "the planned place without friction {without} L* for strips of {lengths} L*, over all M_0 {least:+.2f} to "
            "{most:+.2f} L*; an eta_b known to 20 % moves it by up to +-{band:.2f}, halved elements and steps by "
            "{error:.2f}; with fabrics' friction {fell} strips fall, the others are laid down"),
    )),
    Source("friction_touch", facts_delay.right_on_triangular, (
        Number("friction_right_triangular", "right", "1", 2, "> 0",
            "smallest M_0 / rho_a g L*^2, up to {largest:g}, with which the triangular path first touches where "
            "planned: {each} L*; with none at {none} L*"),
    )),
    Source("disturbed_rpath", facts_delay.disturbed_rpath, (
        Number("disturbed_rpath_error", "fabric", "L*", 2, "< 0.3",
            "largest error of the first touch on a disturbed R-path with the friction of a fabric, M_0 of {moment:g}; "
            "without friction {free:.2f}, {others} ({disturbances})", lambda f: f.free > f.fabric),
    )),
    Source("fabrics", facts_fabrics.fabrics, (
        Number("fabrics", "count", "count", 4, ">= 20",
            "fabrics with measured areal density and bending rigidity, from publications (data/fabrics.csv); their L* "
            "is {shortest:.1f} to {longest:.1f} cm, median {length:.1f} cm; {bent} have a measured 2HB, and only these "
            "count in the friction of fabrics"),
        Number("fabric_friction_median", "median", "1", 2, "no criterion",
            "median M_0 / rho_a g L*^2 of the fabrics with 2HB; smallest {least:.2f}, largest {most:.2f}"),
    )),
    Source("friction_margin fabrics", facts_fabrics.margins, (
        Number("friction_margin_exact", "exact", "1", 2, "> 1",
            "least M_0 of the {bent} fabrics with 2HB over the M_0 that suffices on the R-path of a strip whose eta_b "
            "is known exactly, the least over the lengths; least and median fabric by length: {exact_each}"),
        Number("friction_margin_uncertain", "uncertain", "1", 2, "> 1",
            "the same where eta_b is known to {uncertainty:.0%} and all of the interval must be followed: "
            "{uncertain_each}"),
    )),
    Source("fabric_laws", facts_fabrics.laws, (
        Number("fabric_law_lambda", "fold", "1", 3, "no criterion",
            "median of lambda at the end of the advance at {height:g} L* of {strips} strips with the bending law of "
            "their fabric over that of the linear strip whose eta_b is read from the height of their fold; 90 % lie "
            "within {fold_range}. With eta_b from the secant at the largest curvature {secant_range}, from the slope "
            "along the strip {slope_range}, from the slope averaged over warp and weft {mean_range}; {touch} land "
            "without a snap, {failed} were not followed"),
        Number("fabric_law_warp", "ratio", "1", 2, "no criterion",
            "median of the larger over the smaller slope along warp and weft; the largest {most:.1f}"),
        Number("fabric_law_rpath", "held", "1", 2, "no criterion",
            "share of these strips, of {tried} with a verdict, that follow the R-path planned with the eta_b of their "
            "fold with M_0 = {moment:g} rho_a g L*^2 or less; without friction they are lost at {lost} of it"),
    )),
    Source("textile_law", facts_fabrics.textile_law, (
        Number("textile_law_ratio", "ratio", "1", 3, "no criterion",
            "largest lambda_c of the textile with its measured bending law over that of its secant, gripper at "
            "{heights} L*; smallest {least_ratio:.3f}"),
        Number("textile_law_range", "bend", "1", 2, "no criterion",
            "largest curvature at these snaps over the largest one measured (with the secant {secant_bend:.2f}); it "
            "leaves the measured range at {leaves:.0%} of lambda_c or before"),
        Number("textile_law_path", "lost", "1", 2, "no criterion",
            "share of the R-path planned with the secant that the textile with its measured law, without friction, "
            "follows before it snaps; with the secant {secant_lost:.2f}"),
    )),
    Source("layer_friction", facts_layers.layer_friction, (
        Number("fold_error_mu", "circular", "L*", 3,
            "> 0.1 L* on the circular path at all coefficients of fabrics; < 0.05 L* on the R-path at all, and on all "
            "paths without friction",
            "distance of the finished fold of the circular path from the accurate one with a coefficient of friction "
            "of {mu:g} between the layers, gripper closed, length {length:g} L*, M_0 = {moment:g} rho_a g L*^2 "
            "({r_path:.3f} on the R-path, {triangular:.3f} on the triangular one; {without:.3f} at most without "
            "friction), the gripper at 0.2 sqrt(g L*); at other speeds {speeds}, with half the elements and steps "
            "{finer:.3f} off. It is off from a coefficient between {from_:g} and {to:g} on, fabrics have {band_low:g} "
            "to {band_high:g}; after the gripper has opened its end is {edge:.2f} L* past the edge. Length {long:g} "
            "L*: {long_circular:.2f}, R-path {long_r_path:.3f} ({long_r_path_without:.2f} without internal friction), "
            "triangular {long_triangular:.3f}",
            lambda f: f.in_band and max(f.r_path_most, f.without) < 0.05, "varies"),
        Number("fold_error_fabric", "fabric", "L*", 3, "> 1 L*, on the R-path < 0.1 L*",
            "the same with M_0 = {fabric_moment:g} rho_a g L*^2, as fabrics have ({fabric_r_path:.3f} on the R-path, "
            "{fabric_triangular:.3f} on the triangular one)", lambda f: f.fabric_r_path < 0.1),
        Number("layer_friction_energy", "created", "rho_a g L*^2", 2, "< 1e-6",
            "largest energy that stick and slip and the defect of the balance made in a fold, of {runs}; friction "
            "between the layers took up to {dissipated:.2g}", lambda f: f.runs >= 15),
    )),
    Source("random_paths", facts_paths.random_paths, (
        Number("random_paths", "paths", "count", 4, ">= 200",
            "random gripper paths ({seed}), each assessed twice ({counts}); critical points of both runs at most "
            "{apart:.1e} L* apart"),
        Number("random_paths_undecided", "undecided", "count", 4, "<= 2, of 200 or more",
            "random paths without a verdict, of {paths} ({seed}): an error, or two runs that contradict each other "
            "({contradicted})", lambda f: f.paths >= 200),
    )),
    Source("assess_benchmark", facts.process, (
        Number("time_assess", "seconds", "s", 3, "<= 4 s, difference <= 5e-3",
            "median time of one `stripfold assess` of an R-path with its fall, one core, new process; "
            "{memory:.0f} MB, difference {error:.1e} of the length from half the elements",
            lambda f: f.error <= 5e-3),
    )),
    Source("robot_log_benchmark", facts.robot_log, (
        Number("robot_log_cost", "cost", "factor", 3, "<= 1.5, critical points at most 1 mm apart",
            "time of one `stripfold assess --smooth` of a robot's log, 1201 rows with 0.2 mm of noise, over that of "
            "the log without noise ({noisy:.2f} s over {smooth:.2f} s, {mb:.0f} MB); critical point {apart:.2f} mm off",
            lambda f: f.apart <= 1.0),
    )),
)
# fmt: on
