# Verification studies, at the scale that the configuration says. Those of times have the machine to themselves.

TIMED = {
    "accuracy",
    "benchmark",
    "falls",
    "folding_plans",
    "order",
    "peers",
    "stability_map",
    "sweeps",
    "video_benchmark",
}
# Long cases that share all cores.
SHARED = {"recordings_accuracy"}
# What a study needs beside the environment; without it its numbers are left out.
NEEDED = {
    "public_pictures": config["images"],
    "peers": "verification/peers/.venv",
}
PICTURED = {"public_pictures", "eta_pictures"}
STUDY_FILES = {
    name: f"{RESULTS}/studies/{name}.nc"
    for name in STUDIES
    if name != "paper" and Path(NEEDED.get(name, ".")).exists()
}
STUDY_CODE = [str(path) for path in sorted(Path("verification").rglob("*.py")) if ".venv" not in path.parts]

for study_name, study_file in STUDY_FILES.items():

    rule:
        name:
            study_name
        input:
            code=[str(file_of(study_name).relative_to(workflow.basedir)), "verification/common.py"],
        output:
            study_file,
        log:
            f"{LOGS}/{study_name}.log",
        benchmark:
            f"{BENCHMARKS}/studies/{study_name}.tsv"
        threads: ALL_CORES if study_name in TIMED | SHARED and config["scale"] != "quick" else 1
        resources:
            mem_mb=4000 if "recordings" in study_name else 2000,
            runtime=120,
        params:
            **calls(
                f"verification.{study_name}:run",
                title=title_of(study_name),
                **({"images": config["images"]} if study_name in PICTURED else {}),
                **config["studies"].get(study_name, {}),
            ),
        message:
            f"Study {study_name}."
        script:
            "../script.py"


rule studies:
    """All studies."""
    input:
        list(STUDY_FILES.values()),
