from pdrom.core.logs import job_log
from pdrom.core.provenance import made_by
from pdrom.report.paper.build import build

with (
    job_log(snakemake.log[0]),
    made_by(snakemake.rule, snakemake.params.facts, snakemake.params.code),
):
    build(
        snakemake.input.source[0],
        list(snakemake.input.figures),
        list(snakemake.input.inputs),
        snakemake.output[0],
    )
