# Verification studies, at the scale that the configuration says. Those of a release's times have the machine to
# themselves.

TIMED = {
    "accuracy",
    "benchmark",
    "effects",
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
ALONE = SHARED | TIMED if config["scale"] == "release" else SHARED
# What a study needs beside the environment; without it its numbers are left out.
NEEDED = {
    "public_pictures": config["images"],
    "peers": "verification/peers/.venv",
}
PICTURED = {"public_pictures", "eta_pictures"}
STUDY_FILES = {
    name: f"{RESULTS}/studies/{name}.nc"
    for name in STUDIES
    if name != "paper" and Path(NEEDED.get(name, ".")).exists() and config["studies"].get(name) is not False
}
STUDY_CODE = [str(path) for path in sorted(Path("verification").rglob("*.py")) if ".venv" not in path.parts]
# Those of a quick run share a few processes: most of the time of a small one is its start.
TOGETHER = 4
STUDY_BATCHES = (
    {f"studies_{i + 1}": list(STUDY_FILES)[i::TOGETHER] for i in range(TOGETHER)}
    if config["scale"] == "quick"
    else {name: [name] for name in STUDY_FILES}
)

for batch, names in STUDY_BATCHES.items():

    rule:
        name:
            batch
        input:
            code=[
                *(str(file_of(name).relative_to(workflow.basedir)) for name in names),
                "verification/common.py",
            ],
        output:
            [STUDY_FILES[name] for name in names],
        log:
            f"{LOGS}/{batch}.log",
        benchmark:
            f"{BENCHMARKS}/studies/{batch}.tsv"
        priority: 3 if len(names) > 1 else 0
        threads: ALL_CORES if ALONE >= {*names} else 1
        resources:
            mem_mb=4000 if "recordings_accuracy" in names else 2000,
            runtime=120,
        params:
            **calls("verification:run"),
            studies={
                name: {
                    **({"images": config["images"]} if name in PICTURED else {}),
                    **config["studies"].get(name, {}),
                }
                for name in names
            },
        message:
            f"Studies: {', '.join(names)}."
        script:
            "../script.py"


rule studies:
    """All studies."""
    input:
        list(STUDY_FILES.values()),
