from pdrom.logs import job_log
from pdrom.stages.ladder import climb

with job_log(snakemake.log[0]):
    climb(
        {key: snakemake.wildcards[key] for key in ("scene", "group")},
        snakemake.params.scene,
        snakemake.params.ladder,
        snakemake.params.blowup_extent,
        snakemake.params.solver,
        snakemake.input.mesh,
        snakemake.input.fom,
        snakemake.input.snapshots,
        snakemake.output.table,
        snakemake.output.runs,
    )
