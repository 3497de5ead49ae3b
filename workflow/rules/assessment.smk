# Section V of the paper: folding paths, and the friction that the R-path needs. One job per material.

PATHS = ["r-path", "triangular", "circular"]


rule assess:
    output:
        expand(f"{RESULTS}/assess/{{{{material}}}}_{{path}}.nc", path=PATHS),
    log:
        f"{LOGS}/assess_{{material}}.log",
    benchmark:
        f"{BENCHMARKS}/assess/{{material}}.tsv"
    resources:
        mem_mb=1000,
        runtime=20,
    params:
        material=lambda wildcards: MATERIALS[wildcards.material],
        gravity=CONFIG["gravity"],
        refinement=CONFIG["assessment"]["refinement"],
        paths=PATHS,
    script:
        "../scripts/assess.py"


rule assessment:
    input:
        expand(f"{RESULTS}/assess/{{material}}_{{path}}.nc", material=MATERIALS, path=PATHS),
    output:
        f"{RESULTS}/assessment.nc",
    log:
        f"{LOGS}/assessment.log",
    benchmark:
        f"{BENCHMARKS}/assessment/all.tsv"
    params:
        labels={name: material["label"] for name, material in MATERIALS.items()},
        paths=PATHS,
    script:
        "../scripts/assessment.py"


rule friction:
    output:
        f"{RESULTS}/friction/{{material}}.nc",
    log:
        f"{LOGS}/friction_{{material}}.log",
    benchmark:
        f"{BENCHMARKS}/friction/{{material}}.tsv"
    resources:
        mem_mb=1000,
        runtime=20,
    params:
        material=lambda wildcards: MATERIALS[wildcards.material],
        gravity=CONFIG["gravity"],
        refinement=CONFIG["assessment"]["friction_refinement"],
        step=CONFIG["assessment"]["step"],
    script:
        "../scripts/friction.py"


rule friction_table:
    input:
        runs=expand(f"{RESULTS}/friction/{{material}}.nc", material=MATERIALS),
        ways=expand(f"{RESULTS}/two_ways/{{material}}.nc", material=MATERIALS),
    output:
        f"{RESULTS}/friction.nc",
    log:
        f"{LOGS}/friction_table.log",
    benchmark:
        f"{BENCHMARKS}/friction_table/all.tsv"
    params:
        labels={name: material["label"] for name, material in MATERIALS.items()},
    script:
        "../scripts/friction_table.py"


rule two_ways:
    output:
        f"{RESULTS}/two_ways/{{material}}.nc",
    log:
        f"{LOGS}/two_ways_{{material}}.log",
    benchmark:
        f"{BENCHMARKS}/two_ways/{{material}}.tsv"
    resources:
        mem_mb=1000,
        runtime=20,
    params:
        material=lambda wildcards: MATERIALS[wildcards.material],
        gravity=CONFIG["gravity"],
        refinement=CONFIG["assessment"]["refinement"],
    script:
        "../scripts/two_ways.py"


# The material whose single runs are drawn: the second, or the only one.
SHOWN = list(MATERIALS)[min(1, len(MATERIALS) - 1)]


rule plans:
    output:
        f"{RESULTS}/plans.nc",
    log:
        f"{LOGS}/plans.log",
    benchmark:
        f"{BENCHMARKS}/plans/all.tsv"
    params:
        material=MATERIALS[SHOWN],
        gravity=CONFIG["gravity"],
    script:
        "../scripts/plans.py"


rule tangency:
    output:
        f"{RESULTS}/studies/tangency.nc",
    log:
        f"{LOGS}/tangency.log",
    resources:
        mem_mb=1000,
        runtime=30,
    params:
        **CONFIG["studies"]["tangency"],
    script:
        "../scripts/tangency.py"


rule friction_steps:
    output:
        f"{RESULTS}/studies/friction_steps.nc",
    log:
        f"{LOGS}/friction_steps.log",
    resources:
        mem_mb=1000,
        runtime=30,
    params:
        **CONFIG["studies"]["friction_steps"],
    script:
        "../scripts/friction_steps.py"


rule random_paths:
    output:
        f"{RESULTS}/studies/random_paths.nc",
    log:
        f"{LOGS}/random_paths.log",
    threads: workflow.cores
    resources:
        mem_mb=2000,
        runtime=120,
    params:
        **CONFIG["studies"]["random_paths"],
    script:
        "../scripts/random_paths.py"


rule assess_benchmark:
    output:
        f"{RESULTS}/studies/assess_benchmark.nc",
    log:
        f"{LOGS}/assess_benchmark.log",
    threads: ALONE
    params:
        **CONFIG["studies"]["assess_benchmark"],
    script:
        "../scripts/assess_benchmark.py"
