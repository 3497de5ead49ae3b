from pathlib import Path

from _run import logged
from stripfold import store
from stripfold.studies.summary_entry import between
from stripfold.studies.summary_peers import MARKS, table

with logged(snakemake):
    page = Path("docs/peers.md")
    text = between(page.read_text(encoding="utf-8"), MARKS, table(store.read(snakemake.input[0])))
    store.write_text(text, page)
