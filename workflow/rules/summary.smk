# Every number that the README or the docs quote. A reader's run ends with its own beside the release's; `release` writes
# those of the repository, and the tables in the pages.

SUMMARISED = {
    **STUDY_FILES,
    "points": rules.critical_points.output.points,
    "master": rules.critical_points.output.master,
    "collapse": rules.collapse.output[0],
    "plans": rules.plans.output[0],
    "assessment": rules.assessment.output.paths,
    "friction": rules.assessment.output.friction,
    "recordings": rules.recordings.output.table,
}


rule summary:
    """All numbers, each with its criterion, beside those of the release."""
    input:
        **SUMMARISED,
        code=STUDY_CODE,
        claims="workflow/claims.yaml",
    output:
        data=f"{RESULTS}/numbers.json",
        page=in_report(f"{RESULTS}/numbers.html", "summary", "Numbers"),
    log:
        f"{LOGS}/summary.log",
    params:
        **calls("tasks.numbers:summary", figures=FIGURES, release="results/summary.json"),
    script:
        "../script.py"


# Pages with tables of studies.
TABLES = [
    "hard_cases",
    "accuracy",
    "effects",
    "peers",
    "low_paths",
    "barrier",
    "friction_delay",
    "layer_friction",
    "friction_touch",
    "fabrics",
    "fabric_laws",
    "variants",
]


rule release:
    """The numbers of a release, and the tables of the README and of docs."""
    input:
        **{name: STUDY_FILES[name] for name in TABLES if name in STUDY_FILES},
        numbers=rules.summary.output.data,
        figures=FIGURE_FILES,
    output:
        touch(f"{RESULTS}/.released"),
    log:
        f"{LOGS}/release.log",
    params:
        **calls("tasks.numbers:release", release="results/summary.json", scale=config["scale"]),
    script:
        "../script.py"
