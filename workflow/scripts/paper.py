from pathlib import Path

from pdrom.core.logs import job_log
from pdrom.report.paper.build import build

with job_log(snakemake.log[0]):
    build(
        snakemake.input.source,
        str(Path(snakemake.input.figures[0]).parent),
        str(Path(snakemake.input.inputs[0]).parent),
        snakemake.output[0],
    )
