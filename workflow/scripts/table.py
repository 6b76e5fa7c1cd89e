from pdrom.core.logs import job_log
from pdrom.core.provenance import made_by
from pdrom.tables.kit.make import make_table

with (
    job_log(snakemake.log[0]),
    made_by(snakemake.rule, snakemake.params.settings, snakemake.params.code),
):
    made = snakemake.params
    make_table(made.module, dict(snakemake.input.items()), made.settings, snakemake.output[0])
