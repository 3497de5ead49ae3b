# Section IV of the paper, its dynamics: one strip from lambda_0 through its collapse to the end of the motion.

COLLAPSE = f"{RESULTS}/collapse.nc"


rule collapse:
    input:
        CONFIG["collapse"],
    output:
        COLLAPSE,
    log:
        f"{LOGS}/collapse.log",
    benchmark:
        f"{BENCHMARKS}/collapse/all.tsv"
    resources:
        mem_mb=1000,
        runtime=10,
    script:
        "../scripts/collapse.py"


rule film:
    input:
        COLLAPSE,
    output:
        f"{FIGURES}/collapse.mp4",
    log:
        f"{LOGS}/film.log",
    benchmark:
        f"{BENCHMARKS}/film/all.tsv"
    resources:
        mem_mb=1000,
        runtime=10,
    script:
        "../scripts/film.py"


rule falls:
    output:
        f"{RESULTS}/studies/falls.nc",
    log:
        f"{LOGS}/falls.log",
    resources:
        mem_mb=1000,
        runtime=30,
    params:
        **CONFIG["studies"]["falls"],
    script:
        "../scripts/falls.py"


rule fall_benchmark:
    input:
        # A fresh clone gives all files the time of their making: that of the scene says nothing.
        ancient(CONFIG["collapse"]),
    output:
        f"{RESULTS}/studies/fall_benchmark.nc",
    log:
        f"{LOGS}/fall_benchmark.log",
    threads: ALONE
    params:
        **CONFIG["studies"]["benchmark"],
    script:
        "../scripts/fall_benchmark.py"
