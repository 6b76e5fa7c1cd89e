from pathlib import Path

from pdrom.core.logs import job_log
from pdrom.report.drawing import Order, draw

with job_log(snakemake.log[0]):
    draw(
        Order.model_validate(snakemake.params.order),
        str(Path(snakemake.output.pdf).parents[1]),
        snakemake.output.pdf,
        snakemake.output.png,
    )
