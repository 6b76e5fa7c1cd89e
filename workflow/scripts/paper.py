from pdrom.core.logs import job_log
from pdrom.report.paper.build import build

with job_log(snakemake.log[0]):
    build(
        snakemake.input.source[0],
        list(snakemake.input.figures),
        list(snakemake.input.inputs),
        snakemake.output[0],
    )
