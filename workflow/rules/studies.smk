# Long studies of the solver itself. Their results are kept in the repository, so `snakemake all` on a fresh clone does
# not redo them; `make studies` does.


rule limit:
    output:
        f"{RESULTS}/studies/limit.nc",
    log:
        f"{LOGS}/limit.log",
    resources:
        mem_mb=1000,
        runtime=30,
    params:
        **CONFIG["studies"]["limit"],
    script:
        "../scripts/limit.py"


rule order:
    output:
        f"{RESULTS}/studies/order.nc",
    log:
        f"{LOGS}/order.log",
    resources:
        mem_mb=1000,
        runtime=30,
    params:
        **CONFIG["studies"]["order"],
    script:
        "../scripts/order.py"


rule rod:
    output:
        f"{RESULTS}/studies/rod.nc",
    log:
        f"{LOGS}/rod.log",
    resources:
        mem_mb=1000,
        runtime=30,
    params:
        **CONFIG["studies"]["rod"],
    script:
        "../scripts/rod.py"


rule hard_cases:
    output:
        f"{RESULTS}/studies/hard_cases.nc",
    log:
        f"{LOGS}/hard_cases.log",
    resources:
        mem_mb=1000,
        runtime=30,
    params:
        **CONFIG["studies"]["hard_cases"],
    script:
        "../scripts/hard_cases.py"


rule rod_benchmark:
    output:
        f"{RESULTS}/studies/rod_benchmark.nc",
    log:
        f"{LOGS}/rod_benchmark.log",
    threads: ALONE
    params:
        **CONFIG["studies"]["assess_benchmark"],
    script:
        "../scripts/rod_benchmark.py"


rule effects:
    output:
        f"{RESULTS}/studies/effects.nc",
    log:
        f"{LOGS}/effects.log",
    threads: ALONE
    params:
        **CONFIG["studies"]["effects"],
    script:
        "../scripts/effects.py"


rule branches:
    output:
        f"{RESULTS}/studies/branches.nc",
    log:
        f"{LOGS}/branches.log",
    threads: workflow.cores
    resources:
        mem_mb=2000,
        runtime=120,
    params:
        **CONFIG["studies"]["branches"],
    script:
        "../scripts/branches.py"


rule benchmark:
    output:
        f"{RESULTS}/studies/benchmark.nc",
    log:
        f"{LOGS}/benchmark.log",
    threads: ALONE
    params:
        **CONFIG["studies"]["benchmark"],
    script:
        "../scripts/benchmark.py"


rule accuracy:
    output:
        f"{RESULTS}/studies/accuracy.nc",
    log:
        f"{LOGS}/accuracy.log",
    threads: ALONE
    params:
        **CONFIG["studies"]["accuracy"],
    script:
        "../scripts/accuracy.py"


rule profiling:
    output:
        f"{RESULTS}/studies/profiling.nc",
    log:
        f"{LOGS}/profiling.log",
    threads: ALONE
    params:
        **CONFIG["studies"]["profiling"],
    script:
        "../scripts/profiling.py"


rule estimates:
    output:
        f"{RESULTS}/studies/estimates.nc",
    log:
        f"{LOGS}/estimates.log",
    threads: workflow.cores
    resources:
        mem_mb=1000,
        runtime=30,
    params:
        **CONFIG["studies"]["estimates"],
    script:
        "../scripts/estimates.py"


rule studies:
    input:
        rules.limit.output,
        rules.order.output,
        rules.rod.output,
        rules.rod_benchmark.output,
        rules.effects.output,
        rules.branches.output,
        rules.benchmark.output,
        rules.schemes.output,
        rules.modes.output,
        rules.lag.output,
        rules.falls.output,
        rules.fall_benchmark.output,
        rules.tangency.output,
        rules.friction_steps.output,
        rules.random_paths.output,
        rules.hard_cases.output,
        rules.assess_benchmark.output,
        rules.accuracy.output,
        rules.fall_accuracy.output,
        rules.profiling.output,
        rules.estimates.output,
