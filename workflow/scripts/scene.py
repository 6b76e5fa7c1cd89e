from pdrom.core.logs import job_log
from pdrom.report.scenes.job import SceneOrder, make

with job_log(snakemake.log[0]):
    make(SceneOrder.model_validate(snakemake.params.order), dict(snakemake.output.items()))
