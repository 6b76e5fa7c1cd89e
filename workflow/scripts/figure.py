from pathlib import Path

from pdrom.core.logs import job_log
from pdrom.report.drawing import draw
from pdrom.report.figures.sources import PUBLISHED

with job_log(snakemake.log[0]):
    draw(
        snakemake.params.name,
        snakemake.params.spec,
        snakemake.params.holdings,
        str(Path(snakemake.output.pdf).parents[1]),
        str(PUBLISHED),
        snakemake.output.pdf,
        snakemake.output.png,
    )
