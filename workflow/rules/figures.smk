# Every figure from stored files alone, as PNG and SVG.

RUN = f"{RESULTS}/xaxis/{SHOWN}.nc"
ASSESSED = {path: f"{RESULTS}/assess/{SHOWN}_{path}.nc" for path in PATHS}
WAYS, HELD = f"{RESULTS}/two_ways/{SHOWN}.nc", f"{RESULTS}/friction/{SHOWN}.nc"
PLANS, COLLAPSE = rules.plans.output[0], rules.collapse.output[0]
POINTS, MASTER = rules.critical_points.output[0], rules.master_curve.output[0]
# What each figure is drawn from, in the order its function takes it.
SOURCES = {
    "geometry": [RUN],
    "motion": [RUN],
    "deflection": [RUN],
    "collapse": [COLLAPSE],
    "collapse_curve": [COLLAPSE],
    "energy": [COLLAPSE],
    "paths": [POINTS],
    "critical_points": [POINTS],
    "master_curve": [POINTS, MASTER],
    "folding": [PLANS],
    "planned_paths": [PLANS],
    "evolutions": [*(ASSESSED[path] for path in ("r-path", "triangular", "circular")), PLANS],
    "rpath_friction": [ASSESSED["r-path"], WAYS, HELD],
    "rpath_curve": [ASSESSED["r-path"], WAYS, HELD, PLANS],
    "touch_error": rules.assessment.output,
    "friction_needed": rules.friction_table.output,
    "measured": rules.recordings.output,
    "real_paths": rules.recordings.output,
    "printed_law": rules.printed_law.output,
    **{
        figure: [STUDY_FILES[study]]
        for figure, study in {
            "recordings_accuracy": "recordings_accuracy",
            "calibration": "calibration",
            "rod": "rod",
            "work_precision": "accuracy",
            "fall_precision": "fall_accuracy",
            "peers": "peers",
        }.items()
        if study in STUDY_FILES
    },
}
FIGURE_FILES = expand(f"{FIGURES}/{{name}}.{{suffix}}", name=SOURCES, suffix=["png", "svg"])


rule figure:
    input:
        data=lambda wildcards: SOURCES[wildcards.name],
    output:
        png=f"{FIGURES}/{{name}}.png",
        svg=f"{FIGURES}/{{name}}.svg",
    log:
        f"{LOGS}/figure_{{name}}.log",
    benchmark:
        f"{BENCHMARKS}/figure/{{name}}.tsv"
    wildcard_constraints:
        name="|".join(SOURCES),
    params:
        call="tasks.figures:figure",
        drawing=drawing,
        evidence=lambda wildcards: code_digest(drawing(wildcards)),
        options=lambda wildcards: {"material": SHOWN} if wildcards.name == "paths" else {},
    script:
        "../script.py"
