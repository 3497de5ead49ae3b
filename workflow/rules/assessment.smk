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


rule low_path_film:
    """The low path as a film."""
    output:
        in_report(f"{FIGURES}/low_path.mp4", "low_path_film", CATEGORIES["low_paths"]),
    log:
        f"{LOGS}/low_path_film.log",
    benchmark:
        f"{BENCHMARKS}/low_path_film/all.tsv"
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        **calls("tasks.folding:low_path_film", material=MATERIALS[SHOWN], gravity=config["gravity"]),
    script:
        "../script.py"


rule two_folds:
    """A triangular and a low path side by side, as a moving picture."""
    output:
        in_report(f"{FIGURES}/two_folds.gif", "two_folds", CATEGORIES["low_paths"]),
    log:
        f"{LOGS}/two_folds.log",
    benchmark:
        f"{BENCHMARKS}/two_folds/all.tsv"
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        **calls("tasks.folding:two_folds", material=MATERIALS[SHOWN], gravity=config["gravity"]),
    script:
        "../script.py"


rule assessment:
    """Table of the folding paths of all materials."""
    input:
        runs=expand(f"{RESULTS}/assess/{{material}}_{{path}}.nc", material=MATERIALS, path=PATHS),
    output:
        f"{RESULTS}/assessment.nc",
    log:
        f"{LOGS}/assessment.log",
    benchmark:
        f"{BENCHMARKS}/assessment/all.tsv"
    params:
        **calls("tasks.folding:assessment", title="folding paths assessed", labels=LABELS, paths=PATHS),
    script:
        "../script.py"


rule friction:
    """Smallest internal friction that keeps one material on the R-path."""
    output:
        f"{RESULTS}/friction/{{material}}.nc",
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
            refinement=config["assessment"]["friction_refinement"],
            step=config["assessment"]["step"],
        ),
    script:
        "../script.py"


rule two_ways:
    """The two ways out of the R-path of one material without friction."""
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
        **calls(
            "tasks.folding:two_ways",
            material=of_material,
            gravity=config["gravity"],
            refinement=config["assessment"]["refinement"],
        ),
    script:
        "../script.py"


rule friction_table:
    """Table of the friction that the R-path needs, all materials."""
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
        **calls("tasks.folding:friction_table", title="friction that an R-path needs", labels=LABELS),
    script:
        "../script.py"
