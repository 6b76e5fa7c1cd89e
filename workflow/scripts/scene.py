from pdrom.core.logs import job_log
from pdrom.core.provenance import made_by
from pdrom.report.scenes.job import SceneOrder, make

with (
    job_log(snakemake.log[0]),
    made_by(snakemake.rule, snakemake.params.order, snakemake.params.code),
):
    make(SceneOrder.model_validate(snakemake.params.order), dict(snakemake.output.items()))
