# Every figure from stored files alone, as PNG and SVG.

# The material whose single runs are drawn: the second, or the only one.
SHOWN = list(MATERIALS)[min(1, len(MATERIALS) - 1)]
RUN = f"{RESULTS}/xaxis/{SHOWN}.nc"
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
    "printed_law": [f"{RESULTS}/printed_law.nc"],
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
    wildcard_constraints:
        name="|".join(SOURCES),
    params:
        options=lambda wildcards: {"material": SHOWN} if wildcards.name == "paths" else {},
    script:
        "../scripts/figure.py"
