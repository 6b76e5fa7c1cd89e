from pdrom.logs import job_log
from pdrom.stages.paper import build

with job_log(snakemake.log[0]):
    build(
        snakemake.input.source,
        snakemake.params.figures,
        snakemake.params.inputs,
        snakemake.output[0],
    )
