from pdrom.core.logs import job_log
from pdrom.experiments.snapshots import collect_snapshots

with job_log(snakemake.log[0]):
    collect_snapshots(
        snakemake.params.scene,
        snakemake.wildcards.group,
        snakemake.input.mesh,
        snakemake.input.train,
        snakemake.input.heldout,
        snakemake.output[0],
    )
