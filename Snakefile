# The paper's runs, figures and numbers. `snakemake all` makes everything; any single file or rule can be asked for.
from snakemake.utils import min_version

min_version("9.0")


# Unless another is given: Snakemake would fill in from this one what another leaves out.
if not workflow.configfiles:

    configfile: "workflow/config/paper.yaml"


include: "workflow/rules/common.smk"


# What takes a second or two is not worth a job of a cluster.
localrules:
    all,
    assessment,
    critical_points,
    explorer_page,
    plans,
    recordings,
    release,
    studies,


wildcard_constraints:
    material="|".join(MATERIALS),


include: "workflow/rules/continuation.smk"
include: "workflow/rules/assessment.smk"
include: "workflow/rules/studies.smk"
include: "workflow/rules/recordings.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/summary.smk"


rule all:
    """Everything of the paper: runs, tables, figures, film and numbers."""
    default_target: True
    input:
        rules.critical_points.output,
        rules.films.output,
        rules.assessment.output,
        rules.recordings.output,
        rules.summary.output,
        FIGURE_FILES,
        rules.explorer_page.output,


# Each rule says once what it does: in its docstring, those made in a loop in their message. It is both.
for made in workflow.rules:
    made.docstring = made.docstring or made.message
    made.message = f"{{rule}}{' {wildcards}' if made.has_wildcards() else ''}: {made.docstring}"
    # The project's own source files: the package and the libraries are in the digest.
    if "call" in made.params.keys() and "code" not in made.input.keys():
        made.set_input(code=partial(code, made.params["call"]))
