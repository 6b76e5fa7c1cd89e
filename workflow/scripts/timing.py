from pdrom.logs import job_log
from pdrom.stages.timing import time_scene

with job_log(snakemake.log[0]):
    time_scene(
        snakemake.params.scene,
        snakemake.params.methods,
        snakemake.params.ranks,
        snakemake.params.protocol,
        snakemake.params.solver,
        snakemake.params.threads,
        snakemake.input.mesh,
        list(snakemake.input.bases),
        list(snakemake.input.samplings),
        list(snakemake.input.hyper),
        snakemake.output[0],
    )
