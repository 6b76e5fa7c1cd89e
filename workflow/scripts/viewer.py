from pdrom.core.logs import job_log
from pdrom.core.provenance import made_by
from pdrom.report.scenes.job import SceneOrder
from pdrom.report.scenes.viewer import make_index

with (
    job_log(snakemake.log[0]),
    made_by(snakemake.rule, snakemake.params.orders, snakemake.params.code),
):
    orders = map(SceneOrder.model_validate, snakemake.params.orders)
    make_index([order.results for order in orders], snakemake.output.page)
