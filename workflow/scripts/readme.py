import json
from pathlib import Path

from _run import logged

from stripfold import store
from studies import accuracy, cold_run, effects, peers, profiling
from studies.hard_cases import run as hard_cases
from studies.summary import run as summary
from studies.summary.run import fill_table

with logged(snakemake):
    numbers = json.loads(Path(snakemake.input.summary).read_text(encoding="utf-8"))
    data = {name: store.read(path) for name, path in snakemake.input.items() if name != "summary"}
    pages = {
        "README.md": {"presets": accuracy.presets(data["accuracy"]), "numbers": summary.markdown(numbers)},
        "docs/numerics.md": {
            **{
                f"profile of {name}": profiling.table(data["profiling"].sel(subject=name))
                for name in profiling.SUBJECTS
            },
            "cold run": cold_run.table(data["cold_run"]),
        },
        "docs/hard-cases.md": {"hard cases": hard_cases.markdown(data["hard_cases"])},
        "docs/effects.md": {"effects": effects.markdown(data["effects"])},
        "docs/peers.md": {"times": peers.table(data["peers"])} if "peers" in data else {},
    }
    for name, tables in pages.items():
        text = Path(name).read_text(encoding="utf-8")
        for key, content in tables.items():
            text = fill_table(text, key, content)
        store.write_text(text, Path(name))
