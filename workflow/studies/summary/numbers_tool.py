"""Numbers of the project, of its run times, of the command line and of other programs; see :mod:`.table`."""

from __future__ import annotations

from studies.summary import facts, facts_paths, facts_tool
from studies.summary.number import Number, Source

# A table: one formatted argument per line would take five times the space.
# fmt: off
TOOL = (
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
    Source("benchmark", lambda d: {"seconds": d.seconds.median(), "error": d.relative_error.max(), "mb": d.memory}, (
        Number("time_solid_lambda_c", "seconds", "s", 3, "<= 5 s, error <= 5e-3",
            "median time of one solid lambda_c with its error estimate ({error:.0e} relative), one core, new process",
            lambda f: f.error <= 5e-3),
        Number("memory_solid_lambda_c", "mb", "MB", 3, "<= 400 MB", "peak memory of that process"),
    )),
    Source("rod", facts.rod, (
        Number("rod_model_error", "error", "1", 2, "< 1e-3",
            "largest relative distance of the rod's lambda_c from the solid's up to h = {papers:g} L*, mesh errors "
            "up to {mesh:.0e}; at h = {top:g} L* it is {thickest:.0e}.  One number of the rod is fitted to the solid: "
            "their distance follows from the derived sections within {derived:.0e}, and the solid, with one element "
            "across, is {one_across:.0e} from the exact one"),
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
            "core, warm process; at all heights at most {slowest:.2g} s, true errors at most {off:.0e} against much "
            "shorter elements, one across like these, which are within {across:.0e} of the exact solid",
            lambda f: f.estimate <= 1e-3 and f.off <= 1e-3 and f.across <= 1e-3),
        Number("time_elastica", "elastica", "s", 3, "<= 0.005 s, difference <= 1e-9",
            "median time of the elastica's critical point at z = {z:g} L*, one core, warm process; at all heights at "
            "most {slowest_elastica:.2g} s and {apart:.0e} from the solution on a finer grid",
            lambda f: f.apart <= 1e-9),
    )),
    Source("estimates", facts.estimates, (
        Number("estimate_coverage", "share", "1", 3, ">= 0.95, judged 0.85 of 300 scenes or more",
            "share of random scenes ({seed}) over the whole range of inputs whose true error of lambda_c or "
            "lambda_touch is within its estimate, in the median {width:.2g} times as large ({by_group}); {judged} of "
            "{cases} scenes are judged, {refused} were refused, {unknown} have no reference that is good enough",
            lambda f: f.cases >= 300 and f.judged >= 0.85 * f.cases),
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
            "calls of all commands by the wheel that run outside of the repository, in environments of each Python "
            "with the lowest versions of the direct dependencies and with the newest ({where}{absent}){failed}",
            lambda f: f.ran == f.calls and f.distinct),
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
        Number("plan_cases", "cases", "count", 3, ">= 150, none ended in an error",
            "random strips with an eta_b known to 20% that `stripfold plan` was asked for: {planned} plans ({kinds}), "
            "{none} refused, {failed} errors", lambda f: f.failed == 0),
        Number("plan_safe", "safe", "1", 4, "= 1",
            "share of the {planned} planned paths that the rod on finer elements follows with the least, the given and "
            "the largest eta_b: the planner's own solver on another mesh, consistency and no proof by other means"),
        Number("plan_none", "none", "count", 3, "a scan confirms all reasons of each",
            "strips for which there is no path; reasons that a scan by the same solver does not confirm: {unconfirmed}",
            lambda f: f.unconfirmed == 0),
        Number("plan_seconds", "seconds", "s", 2, "<= 2 s",
            "median time of a plan or a refusal, one core, warm process; the longest {longest:.2g} s"),
        Number("plan_still_seconds", "still_seconds", "s", 2, "<= 1 s, the longest <= 5 s",
            "the same of {timed:.0f} strips, of half of which without sliding layers a friction moment is known "
            "({r_paths_refused:.0f} R-paths refused although); the longest {still_longest:.2g} s",
            lambda f: f.still_longest <= 5.0),
        Number("plan_speed_seconds", "speed_seconds", "s", 2, "<= 1 s, the longest <= 5 s",
            "the same with `--speed`, 0.03 to 0.3 m/s; the longest {speed_longest:.2g} s",
            lambda f: f.speed_longest <= 5.0),
    )),
    Source("fall_benchmark", facts.process, (
        Number("time_fall", "seconds", "s", 3, "<= 2 s",
            "median time of one `stripfold simulate` (statics, fall to rest, statics again), one core, new process"),
        Number("memory_fall", "memory", "MB", 3, "<= 500 MB", "peak memory of that process"),
    )),
    Source("peers", facts_paths.peers, (
        Number("peer_ratio_{key}", "ratio", "1", 2, "{asked}both reach 0.001 L*",
            "{program}'s time for {task} ({seconds:.2g} s) over that of our {ours}, both to 0.001 L*{note}",
            lambda f: f.both),
    )),
)
# fmt: on
