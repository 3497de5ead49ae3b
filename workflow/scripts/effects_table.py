from pathlib import Path

from _run import logged
from stripfold import store
from stripfold.studies.effects import fill_table

with logged(snakemake):
    page = Path("docs/effects.md")
    data = store.read(snakemake.input[0])
    store.write_text(fill_table(page.read_text(encoding="utf-8"), data), page)
