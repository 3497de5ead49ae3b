# Section IV of the paper: the gripper moves along x. One job per material, since a process start costs seconds.


rule xaxis:
    output:
        f"{RESULTS}/xaxis/{{material}}.nc",
    log:
        f"{LOGS}/xaxis_{{material}}.log",
    benchmark:
        f"{BENCHMARKS}/xaxis/{{material}}.tsv"
    resources:
        mem_mb=1000,
        runtime=20,
    params:
        material=lambda wildcards: MATERIALS[wildcards.material],
        solid=CONFIG["solid"],
        gravity=CONFIG["gravity"],
    script:
        "../scripts/xaxis.py"


rule critical_points:
    input:
        expand(f"{RESULTS}/xaxis/{{material}}.nc", material=MATERIALS),
    output:
        f"{RESULTS}/critical_points.nc",
    log:
        f"{LOGS}/critical_points.log",
    benchmark:
        f"{BENCHMARKS}/critical_points/all.tsv"
    params:
        labels={name: material["label"] for name, material in MATERIALS.items()},
    script:
        "../scripts/critical_points.py"


rule master_curve:
    output:
        f"{RESULTS}/master_curve.nc",
    log:
        f"{LOGS}/master_curve.log",
    benchmark:
        f"{BENCHMARKS}/master_curve/all.tsv"
    params:
        top=max(max(material["heights"]) for material in MATERIALS.values()),
    script:
        "../scripts/master_curve.py"


rule printed_law:
    output:
        f"{RESULTS}/printed_law.nc",
    log:
        f"{LOGS}/printed_law.log",
    benchmark:
        f"{BENCHMARKS}/printed_law/all.tsv"
    script:
        "../scripts/printed_law.py"
