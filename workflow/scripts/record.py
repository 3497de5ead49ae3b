from pathlib import Path

from _run import logged

from stripfold.synthetic.recording import history_of, write_recording
from studies import recordings

with logged(snakemake) as say:
    study, of = snakemake.params, snakemake.params.of
    scene = recordings.scene_of(study.material, of["height"], of["speed"], study.friction, study.length, of["number"])
    say("motion")
    history = history_of(scene)
    say("film")
    write_recording(history, scene, Path(snakemake.output[0]))
