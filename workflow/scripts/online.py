from pdrom.core.logs import job_log
from pdrom.experiments.online import run_online

with job_log(snakemake.log[0]):
    run_online(
        snakemake.params.scene,
        snakemake.params.settings,
        snakemake.params.protocol,
        snakemake.params.root,
        snakemake.output[0],
    )
