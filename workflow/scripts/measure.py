from _run import config_of, logged

from stripfold import store
from stripfold.vision import measure, recording, report, results

with logged(snakemake) as say:
    found = measure.measure(recording.read(snakemake.input[0]), say)
    title = f"measured: {found.recording.entries['title']}"
    store.write_text(report.html(found), snakemake.output.report)
    store.write(results.as_dataset(found), snakemake.output.data, title=title, config=config_of(snakemake))
