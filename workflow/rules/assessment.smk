# Section V of the paper: folding paths, and the friction that the R-path needs. One job per material.

PATHS = ["r-path", "triangular", "circular"]


rule plans:
    """Planned paths of the gripper for the material that is shown."""
    output:
        f"{RESULTS}/plans.nc",
    log:
        f"{LOGS}/plans.log",
    benchmark:
        f"{BENCHMARKS}/plans/all.tsv"
    params:
        **calls("tasks.folding:plans", material=MATERIALS[SHOWN], gravity=config["gravity"]),
    script:
        "../script.py"


rule assess:
    """Folding paths of one material, followed to their ends."""
    output:
        expand(f"{RESULTS}/assess/{{{{material}}}}_{{path}}.nc", path=PATHS),
    log:
        f"{LOGS}/assess_{{material}}.log",
    benchmark:
        f"{BENCHMARKS}/assess/{{material}}.tsv"
    priority: 1
    resources:
        mem_mb=1000,
        runtime=20,
    params:
        **calls(
            "tasks.folding:assess",
            material=of_material,
            gravity=config["gravity"],
            refinement=config["assessment"]["refinement"],
            paths=PATHS,
        ),
    script:
        "../script.py"


rule films:
    """The collapse and the low path as films; a triangular and a low path side by side, as a moving picture."""
    input:
        collapse=rules.collapse.output[0],
    output:
        collapse=in_report(f"{FIGURES}/collapse.mp4", "film", CATEGORIES["collapse"]),
        low_path=in_report(f"{FIGURES}/low_path.mp4", "low_path_film", CATEGORIES["low_paths"]),
        two_folds=in_report(f"{FIGURES}/two_folds.gif", "two_folds", CATEGORIES["low_paths"]),
    log:
        f"{LOGS}/films.log",
    benchmark:
        f"{BENCHMARKS}/films/all.tsv"
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        **calls(
            "tasks.folding:films",
            material=MATERIALS[SHOWN],
            gravity=config["gravity"],
            rate=5 if config["scale"] == "quick" else 30,
        ),
    script:
        "../script.py"


rule friction:
    """Smallest internal friction that keeps one material on the R-path, and its two ways out of it without."""
    output:
        f"{RESULTS}/friction/{{material}}.nc",
        f"{RESULTS}/two_ways/{{material}}.nc",
    log:
        f"{LOGS}/friction_{{material}}.log",
    benchmark:
        f"{BENCHMARKS}/friction/{{material}}.tsv"
    priority: 1
    resources:
        mem_mb=1000,
        runtime=20,
    params:
        **calls(
            "tasks.folding:friction",
            material=of_material,
            gravity=config["gravity"],
            **config["assessment"],
        ),
    script:
        "../script.py"


rule assessment:
    """Tables of the folding paths of all materials, and of the friction that their R-paths need."""
    input:
        runs=expand(f"{RESULTS}/assess/{{material}}_{{path}}.nc", material=MATERIALS, path=PATHS),
        friction=expand(f"{RESULTS}/friction/{{material}}.nc", material=MATERIALS),
        ways=expand(f"{RESULTS}/two_ways/{{material}}.nc", material=MATERIALS),
    output:
        paths=f"{RESULTS}/assessment.nc",
        friction=f"{RESULTS}/friction.nc",
    log:
        f"{LOGS}/assessment.log",
    benchmark:
        f"{BENCHMARKS}/assessment/all.tsv"
    params:
        **calls("tasks.folding:assessment", labels=LABELS, paths=PATHS),
    script:
        "../script.py"
