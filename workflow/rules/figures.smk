# Every figure from stored files alone, as PNG and SVG.

FIGURE_FILES = expand(
    f"{FIGURES}/{{name}}.{{suffix}}",
    name=["geometry", "motion", "deflection", "paths", "critical_points", "master_curve", "printed_law"],
    suffix=["png", "svg"],
)
# The material whose single runs are drawn: the first but one, or the only one.
SHOWN = list(MATERIALS)[min(1, len(MATERIALS) - 1)]


rule figure_of_run:
    input:
        run=f"{RESULTS}/xaxis/{SHOWN}.nc",
    output:
        png=f"{FIGURES}/{{name}}.png",
        svg=f"{FIGURES}/{{name}}.svg",
    wildcard_constraints:
        name="geometry|motion|deflection|paths",
    log:
        f"{LOGS}/figure_{{name}}.log",
    script:
        "../scripts/figure.py"


rule figure_of_points:
    input:
        points=rules.critical_points.output[0],
        master=rules.master_curve.output[0],
    output:
        png=f"{FIGURES}/{{name}}.png",
        svg=f"{FIGURES}/{{name}}.svg",
    wildcard_constraints:
        name="critical_points|master_curve",
    log:
        f"{LOGS}/figure_{{name}}.log",
    script:
        "../scripts/figure.py"


rule figure_of_law:
    input:
        law=rules.printed_law.output[0],
    output:
        png=f"{FIGURES}/{{name}}.png",
        svg=f"{FIGURES}/{{name}}.svg",
    wildcard_constraints:
        name="printed_law",
    log:
        f"{LOGS}/figure_{{name}}.log",
    script:
        "../scripts/figure.py"
