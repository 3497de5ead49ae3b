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
        **calls(
            "tasks.recordings:record",
            of=lambda wildcards: SYNTHETIC[wildcards.synthetic],
            material=lambda wildcards: MATERIALS[SYNTHETIC[wildcards.synthetic]["material"]],
            friction=FILMED["friction"],
            length=FILMED["length_star"],
        ),
    script:
        "../script.py"


rule measure:
    input:
        folder=folder_of,
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
    params:
        **calls("tasks.recordings:measure"),
    script:
        "../script.py"


rule recordings:
    input:
        measured=expand(f"{RESULTS}/measured/{{recording}}.nc", recording=[*SYNTHETIC, *REAL]),
    output:
        f"{RESULTS}/recordings.nc",
    log:
        f"{LOGS}/recordings.log",
    benchmark:
        f"{BENCHMARKS}/recordings/all.tsv"
    params:
        **calls(
            "studies.recordings:table",
            title="lambda measured in recordings",
            names=[*SYNTHETIC, *REAL],
            materials=MATERIALS,
        ),
    script:
        "../script.py"
