from _run import logged

from stripfold import store
from studies.summary.run import summarise

with logged(snakemake) as say:
    sources = dict(snakemake.input.items())
    summary = summarise({name: store.read(path) for name, path in sources.items()}, sources)
    for key, item in summary.items():
        say(f"{key}: {item['value']:g} {item['unit']}; {item['criterion']}: holds: {item['holds']}")
    store.write_json(summary, snakemake.output[0])
