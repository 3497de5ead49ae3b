import json
from pathlib import Path

from _run import logged
from stripfold import store
from stripfold.studies.summary import fill_table

with logged(snakemake):
    summary = json.loads(Path(snakemake.input[0]).read_text(encoding="utf-8"))
    readme = Path("README.md")
    store.write_text(fill_table(readme.read_text(encoding="utf-8"), summary), readme)
