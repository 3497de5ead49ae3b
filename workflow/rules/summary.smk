# Every number that the README or the docs quote, and the tables in them.


CLAIMS = ("workflow/claims.yaml",)


SUMMARISED = {
    **STUDY_FILES,
    "points": rules.critical_points.output[0],
    "master": rules.master_curve.output[0],
    "collapse": rules.collapse.output[0],
    "plans": rules.plans.output[0],
    "printed_law": rules.printed_law.output[0],
    "assessment": rules.assessment.output[0],
    "friction": rules.friction_table.output[0],
    "recordings": rules.recordings.output[0],
}


rule conventions:
    """What compliance-checker finds in the stored files."""
    input:
        list(SUMMARISED.values()),
    output:
        f"{RESULTS}/conventions.nc",
    log:
        f"{LOGS}/conventions.log",
    benchmark:
        f"{BENCHMARKS}/conventions/all.tsv"
    threads: ALL_CORES
    params:
        **calls("conventions:run"),
        title="stored files by the CF and ACDD conventions",
        paths=lambda wildcards, input: list(input),
    script:
        "../script.py"


rule summary:
    """All numbers that the text quotes, each with its criterion."""
    input:
        **SUMMARISED,
        conventions=rules.conventions.output[0],
    output:
        data=f"{RESULTS}/summary.json",
        page=in_report(f"{RESULTS}/summary.html", "summary", "Numbers"),
    log:
        f"{LOGS}/summary.log",
    benchmark:
        f"{BENCHMARKS}/summary/all.tsv"
    params:
        **calls("tasks.numbers:summary", files=CLAIMS),
        sources=lambda wildcards, input: dict(input.items()),
        studies={name: parameters(name, config) for name in STUDY_FILES},
        figures=FIGURES,
    script:
        "../script.py"


rule readme:
    """The generated tables of the README and of docs."""
    input:
        **{
            name: STUDY_FILES[name]
            for name in (
                "hard_cases",
                "accuracy",
                "profiling",
                "effects",
                "cold_run",
                "peers",
                "solver_constants",
                "low_paths",
                "barrier",
                "friction_delay",
                "layer_friction",
                "friction_touch",
                "fabrics",
                "textile_law",
                "variants",
            )
            if name in STUDY_FILES
        },
        summary=rules.summary.output.data,
    log:
        f"{LOGS}/readme.log",
    params:
        **calls("tasks.numbers:fill_tables", files=CLAIMS),
    script:
        "../script.py"
