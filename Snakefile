# The paper's runs, figures and numbers. `snakemake all` makes everything; any single file or rule can be asked for.
import shutil

from snakemake.utils import min_version

min_version("9.0")


configfile: "workflow/config/paper.yaml"


include: "workflow/rules/common.smk"


wildcard_constraints:
    material="|".join(MATERIALS),


include: "workflow/rules/continuation.smk"
include: "workflow/rules/assessment.smk"
include: "workflow/rules/studies.smk"
include: "workflow/rules/recordings.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/summary.smk"


onstart:
    # Snakemake's lock is held: nothing else writes there. What a killed run left half written has no other use.
    for made in (RESULTS, FIGURES):
        for half_written in Path(made).rglob(".stripfold-*"):
            shutil.rmtree(half_written, ignore_errors=True)
    stale = stale_studies(config)
    if stale:
        logger.warning("Stale studies (`make studies` redoes them):")
    for study_name, reason in stale.items():
        logger.warning(f"  {study_name}: {reason}")


rule all:
    default_target: True
    input:
        rules.critical_points.output,
        rules.printed_law.output,
        rules.collapse.output,
        rules.plans.output,
        rules.film.output,
        rules.assessment.output,
        rules.friction_table.output,
        rules.recordings.output,
        rules.summary.output,
        FIGURE_FILES,
        rules.explorer_page.output,
