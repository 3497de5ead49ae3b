# Section IV of the paper: the gripper moves along x, and one strip through its collapse.


rule x_axis:
    """Critical points and branches of one material as the gripper moves along x."""
    output:
        f"{RESULTS}/xaxis/{{material}}.nc",
    log:
        f"{LOGS}/x_axis_{{material}}.log",
    benchmark:
        f"{BENCHMARKS}/x_axis/{{material}}.tsv"
    resources:
        mem_mb=1000,
        runtime=20,
    params:
        **calls(
            "tasks.x_axis:run",
            material=of_material,
            accuracy=config["accuracy"],
            gravity=config["gravity"],
        ),
    script:
        "../script.py"


rule critical_points:
    """Table of the critical points of all materials; those of the elastica in units of L*."""
    input:
        runs=expand(f"{RESULTS}/xaxis/{{material}}.nc", material=MATERIALS),
    output:
        points=f"{RESULTS}/critical_points.nc",
        master=f"{RESULTS}/master_curve.nc",
    log:
        f"{LOGS}/critical_points.log",
    benchmark:
        f"{BENCHMARKS}/critical_points/all.tsv"
    params:
        **calls(
            "tasks.x_axis:critical_points",
            labels=LABELS,
            top=max(max(material["heights"]) for material in MATERIALS.values()),
        ),
    script:
        "../script.py"


rule collapse:
    """One strip through its collapse, statically and in time."""
    input:
        scene=config["collapse"],
    output:
        f"{RESULTS}/collapse.nc",
    log:
        f"{LOGS}/collapse.log",
    benchmark:
        f"{BENCHMARKS}/collapse/all.tsv"
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        **calls("tasks.x_axis:collapse", title="a strip through its collapse"),
    script:
        "../script.py"
