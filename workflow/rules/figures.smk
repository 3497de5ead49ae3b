# Every figure from stored files alone, as PNG and SVG.

RUN = f"{RESULTS}/xaxis/{SHOWN}.nc"
ASSESSED = {path: f"{RESULTS}/assess/{SHOWN}_{path}.nc" for path in PATHS}
WAYS, HELD = f"{RESULTS}/two_ways/{SHOWN}.nc", f"{RESULTS}/friction/{SHOWN}.nc"
PLANS = f"{RESULTS}/plans.nc"
POINTS, MASTER = f"{RESULTS}/critical_points.nc", f"{RESULTS}/master_curve.nc"
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
    "touch_error": [f"{RESULTS}/assessment.nc"],
    "friction_needed": [f"{RESULTS}/friction.nc"],
    "measured": [f"{RESULTS}/recordings.nc"],
    "real_paths": [f"{RESULTS}/recordings.nc"],
    "recordings_accuracy": [f"{RESULTS}/studies/recordings_accuracy.nc"],
    "calibration": [of_images("calibration")],
    "rod": [f"{RESULTS}/studies/rod.nc"],
    "work_precision": [f"{RESULTS}/studies/accuracy.nc"],
    "fall_precision": [f"{RESULTS}/studies/fall_accuracy.nc"],
    "printed_law": [f"{RESULTS}/printed_law.nc"],
    **({"peers": [of_peers()]} if of_peers() else {}),
}
FIGURE_FILES = expand(f"{FIGURES}/{{name}}.{{suffix}}", name=SOURCES, suffix=["png", "svg"])


rule figure:
    input:
        lambda wildcards: SOURCES[wildcards.name],
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
        options=lambda wildcards: {"material": SHOWN} if wildcards.name == "paths" else {},
    script:
        "../scripts/figure.py"
