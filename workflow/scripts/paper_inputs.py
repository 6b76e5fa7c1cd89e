from pathlib import Path

from pdrom.core.logs import job_log
from pdrom.report.paper.build import Facts, write_inputs

with job_log(snakemake.log[0]):
    write_inputs(
        snakemake.input.source[0],
        snakemake.input.references,
        list(snakemake.input.tables),
        snakemake.input.machine,
        Facts.model_validate(snakemake.params.facts),
        str(Path(snakemake.output[0]).parent),
    )
