from pathlib import Path

from pdrom.core.logs import job_log
from pdrom.core.provenance import made_by
from pdrom.report.paper.build import Facts, write_inputs

with (
    job_log(snakemake.log[0]),
    made_by(snakemake.rule, snakemake.params.facts, snakemake.params.code),
):
    write_inputs(
        snakemake.input.source[0],
        snakemake.input.references,
        list(snakemake.input.tables),
        snakemake.input.machine,
        Facts.model_validate(snakemake.params.facts),
        str(Path(snakemake.output[0]).parent),
    )
