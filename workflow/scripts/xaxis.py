from _run import config_of, logged

from configuration import material_of
from stripfold import store
from stripfold.analysis import x_axis as xaxis
from stripfold.analysis.checks import check_branch

with logged(snakemake) as say:
    entry, solid = snakemake.params.material, snakemake.params.solid
    config = config_of(snakemake)
    data = xaxis.run(
        material_of(config, entry),
        entry["length"],
        [*entry["touching_heights"], *entry["heights"]],
        xaxis.refinement_for(solid["accuracy"]),
        say,
        order=solid["order"],
        across=solid["elements_across"],
        law=solid["law"],
    )
    check_branch(data)
    store.write(data, snakemake.output[0], title=f"x-axis continuation, {entry['label']}", config=config)
