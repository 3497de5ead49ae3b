# lambda measured in recordings: in those of data/recordings, one folder each, and in synthetic ones made here, of which
# those of a material share a process. These jobs are the longest and begin first: shorter ones fill the end of a run.

FOLDERS = {name: f"{RESULTS}/recordings/{name}" for name in SYNTHETIC}
BATCHES = {
    material: [name for name, recording in SYNTHETIC.items() if recording["material"] == material]
    for material in FILMED["materials"]
}


for material in BATCHES:

    rule:
        name:
            f"record_{material}"
        output:
            [directory(FOLDERS[name]) for name in BATCHES[material]],
        log:
            f"{LOGS}/record_{material}.log",
        benchmark:
            f"{BENCHMARKS}/record/{material}.tsv"
        priority: 2
        resources:
            mem_mb=1000,
            runtime=60,
        params:
            **calls(
                "tasks.recordings:record",
                recordings=[SYNTHETIC[name] for name in BATCHES[material]],
                material=MATERIALS[material],
                friction=FILMED["friction_moment_star"][FILMED["materials"].index(material)],
                length=FILMED["length_star"],
            ),
        message:
            "Synthetic recordings of one material."
        script:
            "../script.py"


FOLDERS |= {name: f"data/recordings/{name}" for name in REAL}
BATCHES |= {name: [name] for name in REAL}


for batch, names in BATCHES.items():

    rule:
        name:
            f"measure_{batch}"
        input:
            folders=[FOLDERS[name] for name in names],
        output:
            data=expand(f"{RESULTS}/measured/{{recording}}.nc", recording=names),
            report=expand(f"{RESULTS}/measured/{{recording}}.html", recording=names),
        log:
            f"{LOGS}/measure_{batch}.log",
        benchmark:
            f"{BENCHMARKS}/measure/{batch}.tsv"
        priority: 2
        resources:
            mem_mb=2000,
            runtime=60,
        params:
            **calls("tasks.recordings:measure"),
        message:
            "lambda measured in recordings."
        script:
            "../script.py"


# Three frames of one film, for a figure: a slow one of the material that is shown, or of the first that is filmed.
FRAMED = next((name for name in SYNTHETIC if SYNTHETIC[name]["material"] == SHOWN), list(SYNTHETIC)[0])


rule recordings:
    """Table of lambda measured in all recordings, and three frames of a synthetic one."""
    input:
        measured=expand(f"{RESULTS}/measured/{{recording}}.nc", recording=[*SYNTHETIC, *REAL]),
        shown=FOLDERS[FRAMED],
    output:
        table=f"{RESULTS}/recordings.nc",
        frames=f"{RESULTS}/frames.nc",
    log:
        f"{LOGS}/recordings.log",
    benchmark:
        f"{BENCHMARKS}/recordings/all.tsv"
    params:
        **calls("tasks.recordings:table", names=[*SYNTHETIC, *REAL], materials=MATERIALS, framed=FRAMED),
    script:
        "../script.py"
