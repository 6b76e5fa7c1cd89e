from pdrom.core.logs import job_log
from pdrom.experiments.stability import sweep

with job_log(snakemake.log[0]):
    sweep(
        snakemake.params.scene,
        snakemake.params.methods,
        snakemake.params.settings,
        snakemake.params.blowup_extent,
        snakemake.params.solver,
        snakemake.input.mesh,
        snakemake.input.bases,
        snakemake.input.samplings,
        snakemake.input.hyper,
        snakemake.output[0],
    )
