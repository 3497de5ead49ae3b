# Every figure from stored files alone, as PNG and SVG. Figures from the same files share a process.

RUN = f"{RESULTS}/xaxis/{SHOWN}.nc"
ASSESSED = {path: f"{RESULTS}/assess/{SHOWN}_{path}.nc" for path in PATHS}
WAYS, HELD = f"{RESULTS}/two_ways/{SHOWN}.nc", f"{RESULTS}/friction/{SHOWN}.nc"
PLANS, COLLAPSE = rules.plans.output[0], rules.collapse.output[0]
POINTS, MASTER = rules.critical_points.output[0], rules.master_curve.output[0]
# What each figure is drawn from, in the order its function takes it, by the rule that draws it.
SOURCES = {
    "x_axis_figures": {"geometry": [RUN], "motion": [RUN], "deflection": [RUN]},
    "collapse_figures": {"collapse": [COLLAPSE], "collapse_curve": [COLLAPSE], "energy": [COLLAPSE]},
    "critical_figures": {"paths": [POINTS], "critical_points": [POINTS], "master_curve": [POINTS, MASTER]},
    "plan_figures": {"folding": [PLANS], "planned_paths": [PLANS]},
    "path_figures": {
        "evolutions": [*(ASSESSED[path] for path in ("r-path", "triangular", "circular")), PLANS],
        "rpath_friction": [ASSESSED["r-path"], WAYS, HELD, PLANS],
        "rpath_curve": [ASSESSED["r-path"], WAYS, HELD, PLANS],
    },
    "material_figures": {
        "touch_error": [rules.assessment.output[0]],
        "friction_needed": [rules.friction_table.output[0]],
        **(
            {"fabrics": [STUDY_FILES["fabrics"], STUDY_FILES["friction_margin"]]}
            if {"fabrics", "friction_margin"} <= set(STUDY_FILES)
            else {}
        ),
        **(
            {"friction_touch": [STUDY_FILES["friction_touch"], STUDY_FILES["fabrics"]]}
            if {"friction_touch", "fabrics"} <= set(STUDY_FILES)
            else {}
        ),
        **(
            {
                "friction_delay": [
                    STUDY_FILES["friction_delay"],
                    STUDY_FILES["fabrics"],
                    rules.friction_table.output[0],
                ]
            }
            if {"friction_delay", "fabrics"} <= set(STUDY_FILES)
            else {}
        ),
    },
    "recording_figures": {
        "measured": [rules.recordings.output[0]],
        "real_paths": [rules.recordings.output[0], rules.frames.output[0]],
    },
    "study_figures": {
        "printed_law": [rules.printed_law.output[0]],
        **{
            figure: [STUDY_FILES[study]]
            for figure, study in {
                "recordings_accuracy": "recordings_accuracy",
                "calibration": "calibration",
                "order": "order",
                "barrier": "barrier",
                "low_paths": "low_paths",
                "stability_map": "stability_map",
                "eigenvalues": "eigenvalues",
                "layer_friction": "layer_friction",
                "rod": "rod",
                "disturbed_rpath": "disturbed_rpath",
                "work_precision": "accuracy",
                "fall_precision": "fall_accuracy",
                "peers": "peers",
                "textile_law": "textile_law",
            }.items()
            if study in STUDY_FILES
        },
    },
}
FIGURE_FILES = expand(
    f"{FIGURES}/{{name}}.{{suffix}}",
    name=[name for figures in SOURCES.values() for name in figures],
    suffix=["png", "svg"],
)


rule explorer_page:
    """The page in which a reader drags the gripper."""
    input:
        tables=STUDY_FILES["explorer"],
    output:
        in_report(f"{FIGURES}/explorer.html", "explorer", "Explorer"),
    log:
        f"{LOGS}/explorer_page.log",
    params:
        **calls("tasks.explorer:write", files=("workflow/explorer/*",)),
    script:
        "../script.py"


for rule_name, figures in SOURCES.items():

    rule:
        name:
            rule_name
        input:
            sorted({file for files in figures.values() for file in files}),
        output:
            png=expand(f"{FIGURES}/{{name}}.png", name=figures),
            svg=[in_report(f"{FIGURES}/{name}.svg", name, CATEGORIES[name]) for name in figures],
        log:
            f"{LOGS}/{rule_name}.log",
        benchmark:
            f"{BENCHMARKS}/figures/{rule_name}.tsv"
        params:
            call="tasks.figures:figures",
            evidence=" ".join(code_digest(f"plots.{name}:draw") for name in figures),
            drawings=[
                {
                    "module": f"plots.{name}",
                    # A rule's output refers to the rule, which no other process can be given.
                    "files": [str(file) for file in files],
                    "options": {"material": SHOWN} if name == "paths" else {},
                }
                for name, files in figures.items()
            ],
        message:
            f"Figures {', '.join(figures)}."
        script:
            "../script.py"
