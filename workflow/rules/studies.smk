# Studies of the solver and of the measurement. The repository keeps their results, so `snakemake all` does not redo
# them: it says which are stale. `make studies` redoes those.
#
# Each has the machine to itself: what is timed is not disturbed, and what is not shares its cases among all cores.

for study_name, study in STUDIES.items():
    if not configured(study_name, config):
        continue

    rule:
        name:
            study_name
        output:
            f"{RESULTS}/studies/{study_name}.nc",
        log:
            f"{LOGS}/{study_name}.log",
        benchmark:
            f"{BENCHMARKS}/studies/{study_name}.tsv"
        threads: ALONE
        resources:
            mem_mb=study.memory,
            runtime=120,
        params:
            **parameters(study_name, config),
            call=study.call,
            title=study.title,
            files=study.files,
        message:
            f"Study: {study.title}."
        script:
            "../script.py"


STUDY_FILES = {name: kept(name) for name in STUDIES}
# A run in a fresh clone may not have been timed yet.
STUDY_FILES = {
    name: file for name, file in STUDY_FILES.items() if name not in FRESH_CLONE or Path(file).is_file()
}


rule studies:
    """All studies that the configuration asks for."""
    input:
        [file for name, file in STUDY_FILES.items() if name not in APART and configured(name, config)],
