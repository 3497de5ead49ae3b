"""The table of numbers: what each is, where it is from, and the criterion it has to meet.

Keys, statements and criteria are templates of the facts about the source (:mod:`.facts`), in which ``d`` is the dataset
itself.  A criterion that begins with a bound, like ``< 1e-3``, bounds the value; ``also`` judges whatever else it says.
"""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import NamedTuple

from studies.summary import (
    facts,
    facts_claims,
    facts_delay,
    facts_energy,
    facts_fabrics,
    facts_layers,
    facts_low,
    facts_paths,
    facts_tool,
)
from studies.summary.facts import Facts


class Number(NamedTuple):
    """A number, or one for each of its source's facts where there are several; the unit "count" makes it an integer."""

    key: str
    value: str
    unit: str
    digits: int
    criterion: str
    statement: str
    also: Callable[[SimpleNamespace], bool] = lambda f: True
    error: str = ""
    """The fact that is the value's error, in the same unit, where one is known."""


class Source(NamedTuple):
    """Names of the datasets, separated by spaces, the first of which is quoted; the facts about them; the numbers."""

    names: str
    facts: Callable[..., Facts | list[Facts]]
    numbers: tuple[Number, ...]


# A table: one formatted argument per line would take five times the space.
# fmt: off
SOURCES = (
    # The repository itself: whoever summarises supplies this dataset.
    Source("project", facts_paths.project, (
        Number("stale_studies", "stale", "count", 4, "= 0",
            "stored studies, of {studies}, whose code, configuration or libraries have changed since: {names}"),
        Number("package_lines", "package_lines", "count", 9, "no criterion; about 15000 is the aim",
            "lines of `src/stripfold/**/*.py`"),
        Number("studies_seconds", "studies_seconds", "s", 3, "<= 900 s, none without",
            "time of all stored studies, one after the other, as stored with each; {untimed} have none stored",
            lambda f: f.untimed == 0),
        Number("docs_examples", "docs_examples", "count", 4, ">= 12",
            "blocks of Python or commands in the README and docs that `tests/test_docs_examples.py` runs"),
        Number("ci_seconds", "ci_seconds", "s", 3, "<= 480 s", "time of one run of the checks, `.ci/run`, two cores"),
    )),
    Source("conventions", facts_paths.conventions, (
        Number("cf_errors", "errors", "count", 4, "= 0",
            "errors by the conventions CF 1.11 that compliance-checker finds in {files} stored files (in: {which}); of "
            "what ACDD 1.3 highly recommends of a whole file {omissions} are missing"),
    )),
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
            "observed order of lambda_c in the element length on the rod, meshes refined uniformly from {coarsest} "
            "elements; on the solid {solid:.2f}", lambda f: f.rod > 3.7 and f.solid >= 3.0),
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
        Number("second_gripper_gain", "gain", "L*", 4, ">= 0.9 of the best of a scan, all heights, none failed",
            "rise of the advance up to which a strip is stable, at most its length, by a second gripper at the place "
            "that moves most in the critical mode, rod, z = {z:g} L*; the least over the heights of {lowest_z:g} to "
            "{highest_z:g} L* is {worst:.2f} of the best of {places} places, {early:.2f} if it is taken up to "
            "{earliest:g} L* before lambda_c",
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
    Source("benchmark", lambda d: {"seconds": d.seconds.median(), "error": d.relative_error.max(), "mb": d.memory}, (
        Number("time_solid_lambda_c", "seconds", "s", 3, "<= 5 s, error <= 5e-3",
            "median time of one solid lambda_c with its error estimate ({error:.0e} relative), one core, new process",
            lambda f: f.error <= 5e-3),
        Number("memory_solid_lambda_c", "mb", "MB", 3, "<= 400 MB", "peak memory of that process"),
    )),
    Source("rod", facts.rod, (
        Number("rod_model_error", "error", "1", 2, "< 1e-3",
            "largest relative distance of the rod's lambda_c from the solid's up to h = {papers:g} L*, mesh errors "
            "up to {mesh:.0e}; at h = {top:g} L* it is {thickest:.0e}"),
    )),
    Source("rod_benchmark", lambda d: {"seconds": d.seconds.median(), "error": d.estimated_error,
                                    "static": d.seconds_static.median(), "assess": d.seconds_assess.median(),
                                    "apart": d.apart}, (
        Number("time_rod_1e-3", "seconds", "s", 3, "<= 0.02 s, error <= 1e-3",
            "median time of one lambda_c of the rod with its error estimate ({error:.0e} relative), one core, warm "
            "process", lambda f: f.error <= 1e-3),
        Number("time_assess_static_rod", "static", "s", 3, "<= 0.15 s",
            "median time of the verdict on one R-path on the rod, from statics alone, one core, warm process"),
        Number("time_assess_rod", "assess", "s", 3, "<= 0.8 s, difference <= 5e-3",
            "median time of one R-path assessed on the rod with its fall, one core, warm process; critical point and "
            "first touch differ from the solid's by {apart:.0e} of the length", lambda f: f.apart <= 5e-3),
    )),
    Source("cli_benchmark", lambda d: {"seconds": d.wall.median(), "solving": d.solving, "error": d.error}, (
        Number("time_cli", "seconds", "s", 3, "<= 1 s, error <= 1e-3",
            "median time of one `stripfold critical --model rod` ({error:.0e} relative), one core, new process; the "
            "solver takes {solving:.2g} s of it", lambda f: f.error <= 1e-3),
    )),
    Source("accuracy", facts.accuracy, (
        Number("time_solid_1e-3", "seconds", "s", 3, "<= 0.2 s, estimate and true errors <= 1e-3",
            "median time of one solid lambda_c with its error estimate ({estimate:.0e} relative) at z = {z:g} L*, one "
            "core, warm process; at all heights at most {slowest:.2g} s, true errors at most {off:.0e}",
            lambda f: f.estimate <= 1e-3 and f.off <= 1e-3),
        Number("time_elastica", "elastica", "s", 3, "<= 0.005 s, difference <= 1e-9",
            "median time of the elastica's critical point at z = {z:g} L*, one core, warm process; at all heights at "
            "most {slowest_elastica:.2g} s and {apart:.0e} from the solution on a finer grid",
            lambda f: f.apart <= 1e-9),
    )),
    Source("estimates", facts.estimates, (
        Number("estimate_coverage", "share", "1", 3, ">= 0.95, of 300 scenes or more",
            "share of {cases} random scenes ({seed}) whose true error of lambda_c is within its estimate (by the "
            "model asked for: {by_model}); the {missing} without a number count as outside",
            lambda f: f.cases >= 300),
    )),
    Source("hard_cases", facts.hard_cases, (
        Number("hard_cases", "cases", "count", 4, ">= 25",
            "hard cases of the solver (docs/hard-cases.md); {values} end in a value that is compared with an "
            "independent one, {errors} in a typed error"),
        Number("hard_cases_failed", "failed", "count", 4, "= 0",
            "hard cases, of {cases}, that do not end in the one outcome expected of them: {names}"),
    )),
    Source("effects", facts.effects, (
        Number("effects_overhead", "cost", "1", 2, "< 0.05, and none changes the result",
            "largest relative cost of an effect that is on and not needed, on the same model, {d.sizes[scene]} scenes "
            "({by_effect}); {changed} of {idle} change the result by more than its tolerance",
            lambda f: f.changed == 0),
        Number("effects_undetected", "unseen", "count", 4, "= 0 of at least one, and no comparison failed",
            "effects that are off, change the result and are not reported as missing, of {lacking}; {failed} "
            "comparisons failed", lambda f: f.failed == 0 and f.lacking > 0),
    )),
    Source("cold_run", facts.cold_run, (
        Number("time_all", "wall", "s", 3, "<= 300 s",
            "`snakemake all` from nothing in a fresh clone on {d.attrs[cores]} cores, stored studies not redone "
            "({jobs} jobs; most time: {most})"),
    )),
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
    Source("kills", facts_tool.kills, (
        Number("kills", "kills", "count", 4, ">= 50",
            "times that all processes of `make all` were killed at a random moment (seed {d.attrs[seed]}), "
            "{terminated} by SIGTERM, the others by SIGKILL; jobs were under way at {in_jobs}; an undisturbed run "
            "takes {d.attrs[wall]:.0f} s"),
        Number("kills_recovered", "recovered", "count", 4, "all of them; nothing half written left by SIGTERM",
            "of them after which the next `make all` went on by itself, and the chain ended with the same "
            "{d.attrs[files]} files, run times and logs apart, bit for bit as undisturbed; {left:.0f} half-written "
            "files left by SIGTERM{differs}", lambda f: f.recovered == f.kills and f.left == 0),
    )),
    Source("slurm_run", facts_tool.slurm_run, (
        Number("slurm_equal", "share", "1", 4, "= 1, of 20 or more",
            "share of {files} results of the small run that are the same bit for bit when Slurm runs its jobs, run "
            "times apart: {d.attrs[jobs]} jobs, {d.attrs[wall_there]:.0f} s, without Slurm {d.attrs[wall_here]:.0f} "
            "s{different}", lambda f: f.files >= 20),
    )),
    # The command line.
    Source("commands", facts_tool.commands, (
        Number("repeat_bitwise", "share", "1", 4, "= 1, all commands among them",
            "share of {cases} calls of {commands} commands, {d.attrs[repeats]} times each in new processes, that "
            "always print the same, the run time apart, and write the same bytes, {files} files{different}",
            lambda f: f.commands == f.known),
    )),
    Source("fuzz", facts_tool.fuzz, (
        Number("fuzz_inputs", "inputs", "count", 6, ">= 10000",
            "malformed and odd inputs of all commands, drawn by Hypothesis (seed {d.attrs[seed]}): {by_kind}; "
            "{refused} end in an error, {answered} in a result, {followed} in a computation that is left out here"),
        Number("fuzz_failures", "failed", "count", 4, "= 0",
            "of them that end otherwise than in a result or in one line and an exit code for bad input, print what is "
            "not finite as a result, take more than 1 GB or 30 s{failures}"),
    )),
    Source("wheels", facts_tool.wheels, (
        Number("wheel_commands", "ran", "count", 4, "all {calls}",
            "calls of all commands by the wheel that run outside of the repository, both with the lowest versions of "
            "the direct dependencies ({d.attrs[lowest]}) and with the newest ({d.attrs[newest]}){failed}",
            lambda f: f.ran == f.calls and f.lowest != f.newest),
    )),
    Source("sweeps", facts_paths.sweeps, (
        Number("sweep_scenes", "scenes", "count", 6, ">= 100000, each with its result",
            "strips in one `stripfold sweep` of the elastica: {wall:.2g} s on {d.attrs[cores]} cores, {snaps} snaps, "
            "{none} without a result, {memory:.0f} MB at most in the process that gathers the results; of {checked} of "
            "them found alone lambda is within {apart:.0e} L*", lambda f: f.none == 0 and f.apart < 1e-9),
        Number("sweep_rate", "rod", "1/s", 3, ">= 50 on the rod, >= 500 on the elastica",
            "critical points of the rod over the time of the whole command, {rod_scenes} strips on {d.attrs[cores]} "
            "cores; of the elastica {elastica:.0f}", lambda f: f.elastica >= 500.0),
        Number("sweep_cost", "cost", "s", 2, "< 0.04 s on the rod, < 0.004 s on the elastica",
            "processor time per strip of the rod's sweep, the start of all processes included; of the elastica's "
            "{elastica_cost:.1e} s; a million strips: {million:.2g} h and {elastica_million:.2g} h",
            lambda f: f.elastica_cost < 0.004),
        Number("dry_run_seconds", "dry_run", "s", 2, "< 60 s, of 100000 strips or more",
            "time of `snakemake -n` for a sweep of {jobs_scenes} strips of the rod, a job for each chunk",
            lambda f: f.jobs_scenes >= 1e5),
    )),
    Source("folding_plans", facts_paths.folding_plans, (
        Number("plan_cases", "cases", "count", 3, ">= 300, none ended in an error",
            "random strips with an eta_b known to 20% that `stripfold plan` was asked for: {planned} plans ({kinds}), "
            "{none} refused, {failed} errors", lambda f: f.failed == 0),
        Number("plan_safe", "safe", "1", 4, "= 1",
            "share of the {planned} planned paths that the rod on finer elements follows with the least, the given and "
            "the largest eta_b"),
        Number("plan_none", "none", "count", 3, "a scan confirms all reasons of each",
            "strips for which there is no path; reasons not confirmed: {unconfirmed}", lambda f: f.unconfirmed == 0),
        Number("plan_seconds", "seconds", "s", 2, "<= 2 s",
            "median time of a plan or a refusal, one core, warm process; the longest {longest:.2g} s"),
    )),
    Source("fall_benchmark", facts.process, (
        Number("time_fall", "seconds", "s", 3, "<= 2 s",
            "median time of one `stripfold simulate` (statics, fall to rest, statics again), one core, new process"),
        Number("memory_fall", "memory", "MB", 3, "<= 500 MB", "peak memory of that process"),
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
    Source("plans", facts_claims.lying, (
        Number("rpath_lying_change", "change", "L*", 2, "at most the distance of two nodes, {node:.3f} L*",
            "change of the lying length over the last {states} of {all} planned states of the R-path, from the end of "
            "the lift", lambda f: f.change <= f.node * (1.0 + 1e-6) and f.states > 100),
    )),
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
            "({no_snap_each} L*); from the fabrics' least of {real_least:.2f} on {snapping} snaps, and the sag falls "
            "at most {speed:.1f} times as fast as the gripper moves"),
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
    Source("fabrics friction", facts_fabrics.fabrics, (
        Number("fabrics", "count", "count", 4, ">= 20",
            "fabrics with measured areal density and bending rigidity, from publications (data/fabrics.csv); their L* "
            "is {shortest:.1f} to {longest:.1f} cm, median {length:.1f} cm; {bent} have a measured 2HB, and only these "
            "count in the friction of fabrics"),
        Number("fabric_friction_median", "median", "1", 2, "no criterion",
            "median M_0 / rho_a g L*^2 of the fabrics with 2HB; smallest {least:.2f}, largest {most:.2f}"),
        Number("friction_margin", "margin", "1", 2, "> 1",
            "that median over the largest M_0 / rho_a g L*^2 that an R-path needs ({needed:.4f}); of the fabric with "
            "least friction {least_margin:.0f}", lambda f: f.least_margin > 1.0),
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
            "friction); it is off from a coefficient between {from_:g} and {to:g} on, fabrics have {band_low:g} "
            "to {band_high:g}; after the gripper has opened its end is {edge:.2f} L* past the edge. Length {long:g} "
            "L*: {long_circular:.2f}, R-path {long_r_path:.3f} ({long_r_path_without:.2f} without internal friction), "
            "triangular {long_triangular:.3f}",
            lambda f: f.in_band and max(f.r_path_most, f.without) < 0.05, "finer"),
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
    # Pictures and recordings.
    Source("calibration", facts_paths.calibration, (
        Number("calibration_rms", "rms", "pixel", 3, "< 0.25 pixel, no view over 3 times the median",
            "reprojection error of the public chessboard set, all {views} views, the worst {worst:.1f} times the "
            "median", lambda f: f.worst <= 3.0),
    )),
    Source("calibration", lambda d: {"rms": d.charuco_rms, "corners": int(d.charuco_corners)}, (
        Number("charuco_rms", "rms", "pixel", 3, "< 0.25 pixel",
            "reprojection error of the public ChArUco picture with its published camera, {corners} corners"),
    )),
    Source("centrelines", facts_paths.centrelines, (
        Number("centreline_rms", "rms", "mm", 3, "< 0.25 mm",
            "rms distance of the centreline in the photograph of a textile from its authors' midline"),
        Number("centreline_span", "span", "mm", 4, ">= 222 mm", "horizontal extent of that centreline"),
    )),
    Source("strip_looks", facts_paths.strip_looks, (
        Number("strip_looks", "measured", "count", 4, "all of 24 or more",
            "strips measured, of {cases} looks ({seed}): 10, 40 and 80 mm wide, light, dark and two colours as bright "
            "as the table, plain and striped, on plain and textured tables, in either direction; {outside} outside of "
            "their 95 % intervals, at most {worst:.2f} mm off",
            lambda f: f.measured == f.cases >= 24),
    )),
    Source("camera_bump", facts_paths.camera_bump, (
        Number("camera_bump", "share", "1", 3, "= 1, of 30 or more",
            "share of {cases} moves of the camera by 3 to 10 pixels ({seed}) that are noticed, {before} between its "
            "calibration and the film, the others in the film; {chain} of the second generator",
            lambda f: f.noticed == f.cases >= 30),
    )),
    Source("markerless", facts_paths.markerless, (
        Number("markerless_coverage", "share", "1", 3, ">= 0.85, of 18 measured or more",
            "share of the 95 % intervals of lambda that contain the truth, {measured} measured of {cases} recordings "
            "without a marker and without a robot's log, by a template ({seed}); root mean square error {rms:.2f} mm, "
            "median half width {half:.2f} mm", lambda f: f.share >= 0.85 and f.measured >= 18),
    )),
    Source("eta_pictures", facts_paths.eta_pictures, (
        Number("eta_fold_coverage", "share", "1", 3, "0.93 to 0.97, of 400 folds or more",
            "share of the 95 % intervals of eta_b that contain the truth, {cases} drawn folds ({seed}), the {refused} "
            "refused among them; median error {error:.2%}, half width {half:.2%}",
            lambda f: 0.93 <= f.share <= 0.97 and f.cases >= 400),
        Number("eta_not_fabric", "given", "count", 4, "= 0, of 30 or more",
            "eta_b given for pictures that show no strip, by either method, of {empty} ({seed})",
            lambda f: f.given == 0 and f.empty >= 30),
    )),
    Source("recordings_accuracy", facts_paths.recordings_accuracy, (
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
            "its eta_b wrongly, {eta_measured} of {eta_cases} synthetic recordings with a slow gripper that begin 0.7 L* "
            "before the limit ({seed}); largest {eta_worst:.2%}; of {chain_eta_measured} of {chain_eta_cases} of the "
            "second generator, which begin nearer to it, {chain_eta:.2%} and {chain_eta_worst:.2%}",
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
    Source("recordings", facts_paths.recordings, (
        Number("recordings_measured", "measured", "count", 4, ">= 40",
            "recordings, of {all} of the configured materials, in which a snap was measured"),
        Number("measured_above_model", "above", "1", 3, "> 0.9",
            "verification of the measuring chain: share of the {measured} snaps, filmed synthetically with friction in "
            "the strips, that are measured above the frictionless lambda_c; extrapolated to zero speed {zero:.2f}; "
            "recordings without a snap do not count"),
    )),
    Source("video_benchmark", facts_paths.video_benchmark, (
        Number("tracking_rate", "rate", "1/s", 3, ">= 150",
            "frames of 1280 x 720 (h264) over the processor time of the whole command `stripfold measure`, report "
            "included: film of {many} frames, median of {d.sizes[run]} runs; with {frames} frames {short:.0f}"),
        Number("tracking_memory", "memory", "1", 3, "<= 1.15",
            "peak memory of the measuring process with {many} frames over that with {frames}"),
        Number("measure_seconds", "seconds", "s", 2, "<= 6",
            "a recording of the workflow rendered ({render:.1f} s) and measured with its report ({measure:.1f} s); its "
            "motion, a solution in time, takes {motion:.1f} s and does not count"),
    )),
    Source("peers", facts_paths.peers, (
        Number("peer_ratio_{key}", "ratio", "1", 2, "{asked}both reach 0.001 L*",
            "{program}'s time for {task} ({seconds:.2g} s) over that of our {ours}, both to 0.001 L*{note}",
            lambda f: f.both),
    )),
)
# fmt: on
