from pdrom.core.logs import job_log
from pdrom.experiments.ladder import climb

with job_log(snakemake.log[0]):
    climb(
        {key: snakemake.wildcards[key] for key in ("scene", "group")},
        snakemake.params.scene,
        snakemake.params.ladder,
        snakemake.params.floor,
        snakemake.params.blowup_extent,
        snakemake.input.mesh,
        snakemake.input.fom,
        snakemake.input.snapshots,
        snakemake.input.sensitivity,
        snakemake.output[0],
    )
