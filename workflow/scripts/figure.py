from pathlib import Path

from pdrom.core.logs import job_log
from pdrom.core.provenance import made_by
from pdrom.report.drawing import Order, draw

with (
    job_log(snakemake.log[0]),
    made_by(snakemake.rule, snakemake.params.order, snakemake.params.code),
):
    draw(
        Order.model_validate(snakemake.params.order),
        str(Path(snakemake.output.pdf).parents[1]),
        snakemake.output.pdf,
        snakemake.output.png,
    )
