from pdrom.core.logs import job_log
from pdrom.experiments.fom import run_fom

with job_log(snakemake.log[0]):
    run_fom(
        snakemake.params.scene,
        snakemake.input.mesh,
        snakemake.wildcards.run,
        snakemake.params.solver,
        snakemake.threads,
        snakemake.output[0],
    )
