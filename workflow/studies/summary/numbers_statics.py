"""Numbers of critical points, of the models and of their accuracy; see :mod:`.table`."""

from __future__ import annotations

from studies.summary import facts, facts_claims, facts_energy, facts_low
from studies.summary.number import Number, Source

# A table: one formatted argument per line would take five times the space.
# fmt: off
STATICS = (
    # The x-axis study.
    Source("points", facts.points, (
        Number("critical_points", "found", "count", 4, ">= 40", "critical points of the x-axis study, all materials"),
        Number("heights_without_snap", "no_snap", "count", 4, "> 0",
            "heights of that study at which the sag touches the floor layer before lambda has a maximum: no snap"),
        Number("lambda_c_error_max", "error", "1", 2, "< 1e-3",
            "largest estimated relative discretisation error of lambda_c, all {found} critical points"),
        Number("bracket_max", "bracket", "L*", 2, "<= 1e-6 L*", "widest bracket of lambda_c, all {found} of them"),
    )),
    Source("points", facts_claims.eigenvalues, (
        Number("detectors_apart", "apart", "L*", 2, "< 1e-3 L*, detectors agree at every point",
            "largest distance of the lambda at which the smallest eigenvalue is zero from lambda_c, all {found} "
            "critical points; tangent, inertia and eigenvalue agree at {agree}", lambda f: f.agree == f.found),
    )),
    Source("points", facts_claims.slopes, (
        Number("lambda_c_slope", "least", "1", 2, "> 0",
            "least slope of lambda_c over the height, {materials} materials, between neighbouring heights; the largest "
            "{most:.2f}"),
    )),
    Source("points", facts_claims.thickness, (
        Number("density_factor", "factor", "1/m", 3, "> 10",
            "least factor 1/h between the printed ratios with the volumetric and with the areal density, all "
            "materials: {range} in SI"),
    )),
    Source("points master", facts.deviation, (
        Number("collapse_deviation", "deviation", "1", 2, "< 1e-2",
            "largest relative distance of the solid's lambda_c (eta_m as configured) from the elastica's master "
            "curve, all {found} critical points"),
    )),
    Source("master", lambda d: {"z": d.attrs["touch_limit"]}, (
        Number("touch_limit", "z", "L*", 7, "1.58617 to 1e-5",
            "height below which the elastica's sag touches the floor layer before the strip can snap",
            lambda f: abs(f.z - 1.58617) < 1e-5),
    )),
    # The models: verification, accuracy, time.
    Source("limit", facts.limit, (
        Number("solid_limit_error_{eta_m:.0e}", "error", "1", 3, "{rule}",
            "|solid - elastica| / elastica in lambda_c at z = {d.attrs[height_star]:g} L*, eta_m = {eta_m:.0e}, mesh "
            "error {mesh:.0e}{order}", lambda f: f.first_order),
    )),
    Source("limit", lambda d: facts.limit(d)[-1], (
        Number("solid_limit_error", "error", "1", 3, "< 1e-5",
            "|solid - elastica| / elastica in lambda_c at the smallest eta_m, {eta_m:.0e}"),
    )),
    Source("order", facts.order, (
        Number("order_lambda_c", "rod", "1", 3, "> 3.7 on the rod, at least 3 on the solid",
            "observed order of lambda_c in the element length on the rod, between the two finest of the meshes refined "
            "uniformly from {coarsest} elements; on the solid {solid:.2f}", lambda f: f.rod > 3.7 and f.solid >= 3.0),
        Number("order_cost", "cost", "1", 3, "< 1.2, to 10,000 elements or more",
            "order of the run time of one lambda_c in the number of elements, the larger of both models, up to "
            "{elements} elements", lambda f: f.elements >= 10000),
    )),
    Source("solver_constants", lambda d: {"count": d.sizes["constant"], **d.attrs}, (
        Number("solver_constants", "count", "count", 4, "fewer than before, without those of later modules",
            "named numerical constants in the solver's modules, {later} of them in modules of what was added since "
            "(planner, second gripper, map, friction between layers); {before} before the lift-off was an unknown",
            lambda f: f.count - f.later < f.before),
    )),
    Source("low_paths", facts_low.low_paths, (
        Number("low_path_cases", "cases", "count", 4, ">= 200",
            "random low paths ({seed}) followed from the flat strip to the fold on the rod, the first {compared} that "
            "the elastica says are stable on the solid and on elements half as long, too; {failed} runs ended in an "
            "error", lambda f: f.failed == 0),
        Number("low_path_stable", "stable", "1", 4, ">= 1, of 100 or more",
            "share without a limit point of the {inside} paths that the elastica with a lying part that gives says are "
            "stable, {margin:g} L* or more below the touch limit; of the {above} that are above it {snapped} have one, "
            "of the {below} that are too low {squeezed}", lambda f: f.inside >= 100),
        Number("low_path_agreement", "agree", "count", 4, "all of 60 or more",
            "of these on all three meshes, of {compared_inside}", lambda f: f.agree == f.compared_inside >= 60),
        Number("low_path_limit_points", "limited", "count", 4, "= 0, of 60 paths or more",
            "limit points of these on any of the three meshes", lambda f: f.compared_inside >= 60),
        Number("low_path_push", "push", "1", 3, "within 10 % of the elastica's",
            "largest push on what lies of these, times z^2, below a height of {lowest:g} L* ({law:.3f} on the "
            "elastica); the layer that has come down slides by up to {slide:.2f} of the strip's length",
            lambda f: abs(f.push / f.law - 1.0) < 0.1),
        Number("low_path_kinetic", "kinetic", "1", 2, "no criterion: the upper layer moves with the gripper",
            "largest kinetic energy on a low path in time, gripper at {speed:g} sqrt(g L*), over the energy that the "
            "snap of the same strip on the triangular path sets free, with coefficients of friction between the layers "
            "of 0 to {mu:g} and M_0 = {moment:g} rho_a g L*^2, length {length:g} L*; {least_kinetic:.2f} at the best "
            "height; it falls with the speed to the power {exponent:.1f}, a snap's does not"),
        Number("fold_error_low", "error", "L*", 2, "< 0.02 L*",
            "largest distance of the finished fold of these from the accurate one; the gripper pulls with up to "
            "{grip:.1f} rho_a g L* with friction, {grip_without:.1f} without"),
    )),
    Source("barrier", facts_energy.barrier, (
        Number("barrier_coefficient", "measured", "1", 5,
            "within 1e-4 of the normal form; rod and solid within 1e-2; energy and work within 1e-6",
            "energy between the stable and the unstable state at z = {z:g} L* over (lambda_c - lambda)^(3/2), rho_a g "
            "L*^2 per width, elastica, at the smallest distance ({normal:.5g} by the normal form at the limit point, "
            "{rod:+.1%} on the rod, {solid:+.1%} on the solid; {lowest:.3g} to {highest:.3g} at other heights); the "
            "integral of the gripper's forces is the same energy to {work:.0e}, and the law holds to {curved:.1e} up "
            "to the touch", lambda f: f.apart < 1e-4 and f.models < 1e-2 and f.work < 1e-6),
        Number("bistable_width", "width", "L*", 4, "no criterion",
            "distance below lambda_c at z = {z:g} L* up to which the strip has a second state, with the sag on the "
            "floor ({first_width:.1e} L* at z = {first_z:g} L*, {last_width:.2g} L* at {last_z:g} L*); the barrier "
            "there is {largest:.2e} rho_a g L*^2 per width, the kinetic energy of an rms speed of {speed:.2g} "
            "sqrt(g L*) of the free part"),
    )),
    Source("second_gripper", facts_energy.second_gripper, (
        Number("second_gripper_snaps", "still", "count", 2, "= 0, and >= 0.9 of the best of a scan, none failed",
            "strips that still snap with a second gripper at the place that moves most in the critical mode, of "
            "{heights} rods at heights of {lowest_z:g} to {highest_z:g} L*, followed until the gripper has gone as far "
            "as the strip is long; their gain is at least {worst:.2f} of the best of {places} places, {early:.2f} if "
            "they are taken up to {earliest:g} L* before lambda_c",
            lambda f: f.worst >= 0.9 and f.early >= 0.9 and f.places >= 20 and f.failed == 0),
        Number("second_gripper_places", "near", "L*", 2, "no criterion",
            "distance along the strip from that place, {lowest:.2g} to {highest:.2g} L* above the floor, to the "
            "nearest of the scan that does not prevent the snap; {fewest} to {most} of {places} places do, the others "
            "gain up to {without:.0%} of it"),
    )),
    Source("stability_map", facts_energy.stability_map, (
        Number("map_boundary_error", "error", "L*", 2, "< 1e-6 L*, 100 states or more",
            "largest distance along x of the boundaries of the stability map, snap and touch continued in the height, "
            "from {states} critical and touching states of the elastica found alone, at random heights ({seed}), "
            "{lengths} lengths of the strip", lambda f: f.states >= 100),
        Number("map_rod_difference", "rod", "1", 2, "< 1e-3; falls with the thickness squared, exponent 2 within 0.1",
            "largest relative distance of the snap boundary of a rod {thin:.3g} L* thick, continued in the height, "
            "from the map's; its exponent in the thickness is {order:.3g}", lambda f: abs(f.order - 2.0) < 0.1),
        Number("map_seconds", "wall", "s", 2, "<= 5 s, one core",
            "time of one `stripfold map`, the whole process, strip of 16.7 L*: median"),
    )),
    Source("knocks", facts_energy.knocks, (
        Number("knock_threshold", "threshold", "1", 3, "brackets within 0.95 and 1.1",
            "least kinetic energy of a knock along the softest mode that makes a hanging strip fall in time, without "
            "damping, over its static energy barrier, rod, z = {z:g} L*: brackets from {held:.3f} to {fell:.3f}",
            lambda f: f.held > 0.95 and f.fell < 1.1),
        Number("knock_return", "back", "L*", 2, "< 1e-3 L*; within the range the sag stays on the floor",
            "distance from its first state of a strip below its bistable range that comes to rest after a knock that "
            "threw its sag on the floor; within the range: {stays:.2g} L*", lambda f: f.stays > 0.1 and f.touched),
    )),
    Source("variants", facts_energy.variants, (
        Number("variants", "count", "count", 4, ">= 10",
            "other choices of the model whose lambda_c or first touch is compared (docs/physics.md, section 12)"),
        Number("variant_poisson", "poisson", "L*", 2, "< 0.005 L*",
            "largest change of lambda_c at z = {z:g} L* by Poisson's ratio at the same eta_b; by eta_m {stretch:.2g} "
            "L*, by the width up to {narrow:.2g} L*, by a pin that gives or slides up to {pin:.2g} L*"),
        Number("variant_clamp", "clamp", "L*", 2, "no criterion",
            "largest change of the end of the advance by a clamp in place of the gripper's hinge; at {touching} of "
            "{angles} angles the sag touches before lambda has a maximum"),
    )),
    Source("eigenvalues", facts_energy.eigenvalues, (
        Number("eigenvalue_at_critical", "rest", "1", 2, "< 1e-3, four motions",
            "smallest eigenvalue of (K, M) at the last state before a critical point, over the second one: the largest "
            "along x and along three paths, on the rod", lambda f: f.motions == 4),
        Number("eigenvalue_exponent", "snap", "1", 4, "1/2 within 0.02",
            "exponent of the distance with which that eigenvalue goes to zero at a snap, farthest from 1/2 of three "
            "motions", lambda f: f.off < 0.02),
    )),
    Source("explorer", facts_energy.explorer, (
        Number("explorer_error", "error", "L*", 2,
            "< 2e-3 L*, at ten places or more; warns of a fall, keyboard, narrow screen",
            "largest distance of a strip drawn in the explorer from the solver's, {places} gripper positions ({seed}), "
            "dragged to in headless Chromium; paths that fall there: {falls}",
            lambda f: f.places >= 10 and bool(f.warns) and abs(f.keyboard - 0.2) < 1e-6 and f.narrow <= 0
            and f.falls == "triangular circular r-path"),
        Number("explorer_bytes", "bytes", "count", 7, "< 3000000", "size of the explorer, one file"),
    )),
    Source("branches", facts.branches, (
        Number("branch_cases", "cases", "count", 4, ">= 2000",
            "random strips ({seed}) run on the solid and compared with the elastica"),
        Number("branch_jumps", "wrong", "count", 4, "= 0",
            "runs on another branch than the elastica's, of {cases} random strips ({seed}); the {failed} that ended "
            "in an error have no branch and count in `branch_failures`"),
        Number("branch_failures", "failed", "count", 4, "= 0",
            "runs that ended in a typed error instead of a result, of {cases} random strips ({seed})"),
    )),
    Source("branches random_paths", facts.spurious, (
        Number("spurious_limit_points", "spurious", "count", 4, "= 0, of 500 strips and 200 paths or more",
            "maxima of lambda on the branches of {strips} random strips and {paths} random paths (of {drawn}, of which "
            "{refused} are refused) that a finer mesh does not have",
            lambda f: f.strips >= 500 and f.paths >= 200),
    )),
)
# fmt: on
