from _run import config_of, logged

from stripfold import store
from studies import video_benchmark

with logged(snakemake):
    data = video_benchmark.run(**dict(snakemake.params.items()))
    config = config_of(snakemake)
    store.write(data, snakemake.output[0], title="frames per second and memory of measuring a video", config=config)
