# Every figure from stored files alone, as PNG and SVG: those of the paper's runs, and those of studies.

RUN = f"{RESULTS}/xaxis/{SHOWN}.nc"
ASSESSED = {path: f"{RESULTS}/assess/{SHOWN}_{path}.nc" for path in PATHS}
WAYS, HELD = f"{RESULTS}/two_ways/{SHOWN}.nc", f"{RESULTS}/friction/{SHOWN}.nc"
PLANS, COLLAPSE = rules.plans.output[0], rules.collapse.output[0]
POINTS, MASTER = rules.critical_points.output
RECORDINGS, FRAMES = rules.recordings.output
ASSESSMENT, FRICTION = rules.assessment.output
# What each figure is drawn from, in the order its function takes it, by the module that draws it.
PAPER_FIGURES = {
    "x_axis": {"geometry": [RUN], "motion": [RUN], "deflection": [RUN]},
    "through_collapse": {"collapse": [COLLAPSE], "energy": [COLLAPSE]},
    "heights": {"paths": [POINTS], "critical_points": [POINTS], "master_curve": [POINTS, MASTER]},
    "on_paths": {
        "folding": [PLANS],
        "planned_paths": [PLANS],
        "evolutions": [*(ASSESSED[path] for path in ("r-path", "triangular", "circular")), PLANS],
    },
    "r_path": {
        "rpath_friction": [ASSESSED["r-path"], WAYS, HELD, PLANS],
        "rpath_curve": [ASSESSED["r-path"], WAYS, HELD, PLANS],
    },
    "all_materials": {"touch_error": [ASSESSMENT], "friction_needed": [FRICTION]},
    "filmed": {"measured": [RECORDINGS], "real_paths": [RECORDINGS, FRAMES]},
}
# Those of studies: a name is a study, or the table of the friction that R-paths need.
STUDY_FIGURES = {
    **{
        name: [name]
        for name in (
            "barrier disturbed_rpath fabrics folding_plans gripper layer_friction low_paths order peers printed_law "
            "recordings_accuracy rucks stability_map"
        ).split()
    },
    "calibration": ["public_pictures"],
    "textile_law": ["fabric_laws"],
    "fall_precision": ["falls"],
    "rod": ["models"],
    "friction_delay": ["friction_delay", "fabrics", "friction"],
    "friction_touch": ["friction_touch", "fabrics"],
    "work_precision": ["accuracy"],
}
FILES = STUDY_FILES | {"friction": FRICTION}


# For each figure the function that draws it, and its files. Those of a module share a process, in a quick run all.
SOURCES = {
    f"{module}_figures": {name: (f"plots.{module}:draw_{name}", files) for name, files in figures.items()}
    for module, figures in PAPER_FIGURES.items()
}
SOURCES["through_collapse_figures"]["collapse_curve"] = "stripfold.draw.collapse_curve:draw", [COLLAPSE]
if config["scale"] == "quick":
    SOURCES = {
        "paper_figures": {name: drawn for figures in SOURCES.values() for name, drawn in figures.items()}
    }
SOURCES["study_figures"] = {
    name: (f"verification.{studies[0]}:draw", [FILES[study] for study in studies])
    for name, studies in STUDY_FIGURES.items()
    if {*studies} <= {*FILES}
}
PLOTS = sorted(map(str, Path("workflow/plots").glob("*.py")))
FIGURE_FILES = expand(
    f"{FIGURES}/{{name}}.{{suffix}}",
    name=[name for figures in SOURCES.values() for name in figures],
    suffix=["png", "svg"],
)


rule explorer_page:
    """The page in which a reader drags the gripper."""
    input:
        tables=FILES["explorer"],
        code=["workflow/tasks/explorer.py", *sorted(map(str, Path("workflow/explorer").iterdir()))],
    output:
        in_report(f"{FIGURES}/explorer.html", "explorer", "Explorer"),
    log:
        f"{LOGS}/explorer_page.log",
    params:
        **calls("tasks.explorer:write"),
    script:
        "../script.py"


for rule_name, figures in SOURCES.items():

    rule:
        name:
            rule_name
        input:
            sorted({str(file) for _, files in figures.values() for file in files}),
            code=PLOTS + (STUDY_CODE if rule_name == "study_figures" else []),
        output:
            png=expand(f"{FIGURES}/{{name}}.png", name=figures),
            svg=[in_report(f"{FIGURES}/{name}.svg", name, CATEGORIES[name]) for name in figures],
        log:
            f"{LOGS}/{rule_name}.log",
        benchmark:
            f"{BENCHMARKS}/figures/{rule_name}.tsv"
        params:
            **calls("tasks.figures:figures"),
            drawings=[
                {
                    "draw": draw,
                    # A rule's output refers to the rule, which no other process can be given.
                    "files": [str(file) for file in files],
                    "options": {"material": SHOWN} if name == "paths" else {},
                }
                for name, (draw, files) in figures.items()
            ],
        message:
            f"Figures {', '.join(figures)}."
        script:
            "../script.py"
