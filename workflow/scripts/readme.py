import json
from pathlib import Path

from _run import logged
from stripfold import store
from stripfold.studies import hard_cases
from stripfold.studies.profiling import table
from stripfold.studies.summary import fill_table, markdown
from stripfold.studies.summary_accuracy import presets

with logged(snakemake):
    summary = json.loads(Path(snakemake.input.summary).read_text(encoding="utf-8"))
    accuracy, profile = store.read(snakemake.input.accuracy), store.read(snakemake.input.profiling)
    for name, tables in {
        "README.md": {"presets": presets(accuracy), "numbers": markdown(summary)},
        "docs/numerics.md": {"profile": table(profile)},
        "docs/hard-cases.md": {"hard cases": hard_cases.markdown(store.read(snakemake.input.hard_cases))},
    }.items():
        text = Path(name).read_text(encoding="utf-8")
        for key, content in tables.items():
            text = fill_table(text, key, content)
        store.write_text(text, Path(name))
