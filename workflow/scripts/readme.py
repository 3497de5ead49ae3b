import json
from pathlib import Path

from _run import logged
from stripfold import store
from stripfold.studies import hard_cases
from stripfold.studies.summary import between, fill_table

with logged(snakemake):
    summary = json.loads(Path(snakemake.input.summary).read_text(encoding="utf-8"))
    readme, page = Path("README.md"), Path("docs/hard-cases.md")
    store.write_text(fill_table(readme.read_text(encoding="utf-8"), summary), readme)
    cases = hard_cases.markdown(store.read(snakemake.input.hard_cases))
    store.write_text(between(page.read_text(encoding="utf-8"), hard_cases.TABLE, cases), page)
