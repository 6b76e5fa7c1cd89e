from pathlib import Path

from pdrom.figures.sources import PUBLISHED
from pdrom.logs import job_log
from pdrom.stages.figures import draw

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
