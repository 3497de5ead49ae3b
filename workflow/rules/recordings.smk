# lambda measured in recordings: in those of data/recordings, one folder each, and in synthetic ones made here.


rule record:
    output:
        directory(f"{RESULTS}/recordings/{{synthetic}}"),
    log:
        f"{LOGS}/record_{{synthetic}}.log",
    benchmark:
        f"{BENCHMARKS}/record/{{synthetic}}.tsv"
    wildcard_constraints:
        synthetic="|".join(SYNTHETIC),
    resources:
        mem_mb=1000,
        runtime=20,
    params:
        of=lambda wildcards: SYNTHETIC[wildcards.synthetic],
        material=lambda wildcards: MATERIALS[SYNTHETIC[wildcards.synthetic]["material"]],
        friction=FILMED["friction"],
        length=FILMED["length_star"],
    script:
        "../scripts/record.py"


rule measure:
    input:
        folder_of,
    output:
        data=f"{RESULTS}/measured/{{recording}}.nc",
        report=f"{RESULTS}/measured/{{recording}}.html",
    log:
        f"{LOGS}/measure_{{recording}}.log",
    benchmark:
        f"{BENCHMARKS}/measure/{{recording}}.tsv"
    wildcard_constraints:
        recording="|".join([*SYNTHETIC, *REAL]),
    resources:
        mem_mb=2000,
        runtime=20,
    script:
        "../scripts/measure.py"


rule recordings:
    input:
        expand(f"{RESULTS}/measured/{{recording}}.nc", recording=[*SYNTHETIC, *REAL]),
    output:
        f"{RESULTS}/recordings.nc",
    log:
        f"{LOGS}/recordings.log",
    benchmark:
        f"{BENCHMARKS}/recordings/all.tsv"
    params:
        names=[*SYNTHETIC, *REAL],
        materials=MATERIALS,
    script:
        "../scripts/recordings.py"


# Long studies, kept in the repository.


rule recordings_accuracy:
    output:
        f"{RESULTS}/studies/recordings_accuracy.nc",
    log:
        f"{LOGS}/recordings_accuracy.log",
    threads: workflow.cores
    resources:
        mem_mb=4000,
        runtime=120,
    params:
        **CONFIG["studies"]["recordings_accuracy"],
    script:
        "../scripts/recordings_accuracy.py"


rule video_benchmark:
    output:
        f"{RESULTS}/studies/video_benchmark.nc",
    log:
        f"{LOGS}/video_benchmark.log",
    threads: ALONE
    params:
        **CONFIG["studies"]["video_benchmark"],
    script:
        "../scripts/video_benchmark.py"


rule calibration:
    output:
        f"{RESULTS}/studies/calibration.nc",
    log:
        f"{LOGS}/calibration.log",
    params:
        images=CONFIG["images"],
    script:
        "../scripts/calibration.py"


rule centrelines:
    output:
        f"{RESULTS}/studies/centrelines.nc",
    log:
        f"{LOGS}/centrelines.log",
    params:
        images=CONFIG["images"],
    script:
        "../scripts/centrelines.py"
