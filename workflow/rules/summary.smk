# Every number that the README or the docs quote.

# Of a whole run, which no rule of it can be timed by: `make cold` makes it.
COLD_RUN = "results/studies/cold_run.nc"


rule summary:
    input:
        **({"peers": of_peers()} if of_peers() else {}),
        points=rules.critical_points.output[0],
        master=rules.master_curve.output[0],
        limit=rules.limit.output[0],
        order=rules.order.output[0],
        rod=rules.rod.output[0],
        rod_benchmark=rules.rod_benchmark.output[0],
        branches=rules.branches.output[0],
        benchmark=rules.benchmark.output[0],
        schemes=rules.schemes.output[0],
        modes=rules.modes.output[0],
        lag=rules.lag.output[0],
        falls=rules.falls.output[0],
        fall_benchmark=rules.fall_benchmark.output[0],
        assessment=rules.assessment.output[0],
        friction=rules.friction_table.output[0],
        tangency=rules.tangency.output[0],
        friction_steps=rules.friction_steps.output[0],
        random_paths=rules.random_paths.output[0],
        hard_cases=rules.hard_cases.output[0],
        assess_benchmark=rules.assess_benchmark.output[0],
        calibration=of_images("calibration"),
        centrelines=of_images("centrelines"),
        recordings_accuracy=rules.recordings_accuracy.output[0],
        recordings=rules.recordings.output[0],
        video_benchmark=rules.video_benchmark.output[0],
        accuracy=rules.accuracy.output[0],
        estimates=rules.estimates.output[0],
        effects=rules.effects.output[0],
        cold_run=COLD_RUN,
    output:
        f"{RESULTS}/summary.json",
    log:
        f"{LOGS}/summary.log",
    benchmark:
        f"{BENCHMARKS}/summary/all.tsv"
    script:
        "../scripts/summary.py"


rule readme:
    input:
        **({"peers": of_peers()} if of_peers() else {}),
        summary=rules.summary.output[0],
        hard_cases=rules.hard_cases.output[0],
        accuracy=rules.accuracy.output[0],
        profiling=rules.profiling.output[0],
        effects=rules.effects.output[0],
        cold_run=COLD_RUN,
    log:
        f"{LOGS}/readme.log",
    script:
        "../scripts/readme.py"
